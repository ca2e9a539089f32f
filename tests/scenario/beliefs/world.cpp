#include "tests/scenario/beliefs/world.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <utility>

#include "common/math/so3.h"
#include "services/semantic_filter/core/association/score.h"
#include "services/semantic_filter/core/visibility/detectability.h"
#include "services/semantic_filter/priors.h"
#include "tests/support/camera.h"
#include "tools/pipeline/settings.h"

namespace perdure::test {
namespace {

using namespace semantic_filter;  // NOLINT: most names here are the filter's

// Indices of the errors that observations from one place share; they follow one error per class.
constexpr Eigen::Index kAlike = 0, kAzimuth = 1, kBlindAzimuth = 2, kMoreErrors = 3;
// a change of view that has no effect, as in core/measurement/frame.cpp
constexpr double kNever = 1e9;
constexpr double kBlindShare = 0.2, kFlipShare = 0.1;  // values of core/update/azimuth_update.cpp

double normalCdf(double x) { return 0.5 * std::erfc(-x / std::sqrt(2.0)); }

CameraCalibration makeCamera() {
  CameraCalibration camera = tests::cameraAhead(1242, 375, 720.0, {0.3, 0.0, 0.5});
  camera.cx = 620.0, camera.cy = 180.0;
  return camera;
}

ModelInfo modelOf(const sim::DetectorModel& detector, const CameraModel& camera) {
  ModelInfo info;
  info.hash = 23;
  info.name = "told";
  info.classes = detector.classes;
  info.input_width = static_cast<std::uint32_t>(camera.width());
  info.input_height = static_cast<std::uint32_t>(camera.height());
  info.box_sigma = detector.box_share;
  return info;
}

/// √ of the area of the whole outline, pixels.
double sizeOf(const Eigen::Vector4d& sides) {
  return std::sqrt((sides[2] - sides[0]) * (sides[3] - sides[1]));
}

double radiusOf(const State& x) {
  return 0.5 * std::hypot(std::exp(x[kSize]), std::exp(x[kSize + 1]));
}

}  // namespace

Told readTold(const std::vector<std::string>& assignments) {
  tools::PipelineOptions options;
  options.assignments = {"detector.separation=3", "detector.least_separation=1"};
  options.assignments.insert(options.assignments.end(), assignments.begin(), assignments.end());
  const auto configs = tools::readServiceConfigs(options);
  return {configs.semantic_filter, semantic_filter::loadPriors(configs.semantic_filter),
          tools::modelOf(configs.detector)};
}

State Thing::at(double t_s) const {
  State now = x;
  now.head<3>() += t_s * x.tail<3>();
  return now;
}

void World::Drift::draw(sim::Dice& dice, double keep) {
  for (double& value : values) value = keep * value + std::sqrt(1.0 - keep * keep) * dice.normal();
}

World::World(const WorldOptions& options, const Told& told)
    : options_(options),
      told_(told),
      dice_(sim::seedOf("world of beliefs", {options.seed})),
      elusive_dice_(sim::seedOf("what is elusive in the world of beliefs", {options.seed})),
      camera_(makeCamera()),
      model_(modelOf(told.detector, camera_)),
      read_model_(makeModel(model_)),
      directions_(sim::classDirections(told.detector)) {
  place();
  errors_.resize(things_.size());
  for (Errors& e : errors_) {
    e.box.values.setZero(4);
    e.looks.values.setZero(directions_.rows() + kMoreErrors);
  }
}

void World::place() {
  double total = 0.0;
  for (const auto& name : model_.classes) total += told_.priors.of(name).frequency;
  const double way = options_.speed * static_cast<double>(options_.frames) / options_.rate_hz;
  const double from = 6.0, to = way + 70.0;
  const auto count = static_cast<std::size_t>(options_.things_per_m * (to - from));
  for (std::size_t i = 0; i < count; ++i) {
    std::string name = kOtherClass;
    if (!dice_.chance(told_.config.filter.clutter.other_prior)) {
      double left = dice_.uniform(0.0, total);
      for (const auto& one : model_.classes) {
        name = one;
        if ((left -= told_.priors.of(one).frequency) < 0.0) break;
      }
    }
    if (auto thing = draw(name, dice_.uniform(from, to))) things_.push_back(std::move(*thing));
  }
}

/// Draws an object with the size distribution of its class. A standing object is beside the
/// trajectory without overlap; a moving one is on a lane. Returns nothing if there is no room.
std::optional<Thing> World::draw(const std::string& class_name, double x_m) {
  const ClassPrior prior = told_.priors.of(class_name);
  Thing thing;
  thing.class_name = class_name;
  const Eigen::Vector3d unit(dice_.normal(), dice_.normal(), dice_.normal());
  const Eigen::Matrix3d L = prior.log_size_covariance.llt().matrixL();
  thing.x.segment<3>(kSize) = prior.log_size + L * unit;
  thing.x[0] = x_m;
  thing.x[2] = 0.5 * std::exp(thing.x[kSize + 2]);
  thing.x[kYaw] = dice_.uniform(-M_PI, M_PI);
  constexpr double kLargest = 250.0;  // pixels
  thing.comes_out_px = std::exp(
      dice_.uniform(std::log(told_.config.filter.clutter.min_size_px), std::log(kLargest)));
  const double side = dice_.chance(0.5) ? 1.0 : -1.0;
  if (dice_.chance(prior.moving) && options_.motion) {
    const MotionParameters& motion = told_.config.filter.motion;
    double along = 0.0;
    do {
      along = prior.speed_sigma * dice_.normal();
    } while (std::abs(along) < motion.slow_share * prior.speed_sigma &&
             !dice_.chance(motion.creeping));
    thing.x[kYaw] = 0.0;
    thing.x[1] = side * (radiusOf(thing.x) > 1.5 ? 3.2 : 5.2);
    thing.x[kVelocity] = along;
    return thing;
  }
  const double left = -std::log(1.0 - dice_.unit());
  thing.present_until_s = left * told_.config.filter.motion.survival_s;
  for (int attempt = 0; attempt < 20; ++attempt) {
    thing.x[1] = side * dice_.uniform(6.2, 30.0);
    const bool free = std::none_of(things_.begin(), things_.end(), [&](const Thing& other) {
      return !other.moves() &&
             (other.x - thing.x).head<2>().norm() < radiusOf(other.x) + radiusOf(thing.x) + 0.2;
    });
    if (free) return thing;
  }
  return std::nullopt;
}

/// Returns a pose that moves along x with slow turns of a few degrees, and with pitch.
RigidTransform World::truePose(double t_s) const {
  const double phase = static_cast<double>(options_.seed % 7);
  const double yaw = 0.06 * std::sin(0.35 * t_s + phase), pitch = 0.01 * std::sin(1.1 * t_s);
  const double bend = options_.speed * 0.06 / 0.35;  // amplitude of the lateral motion that this
                                                     // yaw causes
  const Eigen::Vector3d p(options_.speed * t_s,
                          -bend * (std::cos(0.35 * t_s + phase) - std::cos(phase)), 1.2);
  return RigidTransform(Eigen::Matrix3d(rotationAboutZ(yaw) * expSo3({0.0, pitch, 0.0})), p);
}

/// Returns odometry with the random walk of the filter's `pose.walk_*`, and its covariance.
Odometry World::odometry(std::uint64_t frame, double t_s) {
  const RigidTransform T_WB = truePose(t_s);
  Odometry o;
  o.stamp.source = 1;
  o.stamp.sequence = frame;
  o.stamp.time = fromNanoseconds(static_cast<std::int64_t>(std::llround(t_s * 1e9)));
  o.instance = 2;
  o.world = {5, 0};
  o.state = OdometryState::kTracking;
  o.has_increment = true;
  o.increment_from = frame > 0 ? frame - 1 : 0;
  if (last_T_WB_ && options_.pose_noise) {
    const PoseParameters& pose = told_.config.filter.pose;
    const double metres = (T_WB.p - last_T_WB_->p).norm();
    Eigen::Matrix<double, 6, 1> sigma;
    sigma << Eigen::Vector3d::Constant(std::sqrt(metres) * pose.walk_rotation),
        Eigen::Vector3d::Constant(std::sqrt(metres) * pose.walk_position);
    o.transition.topLeftCorner<3, 3>() = T_WB.R().transpose() * last_T_WB_->R();
    o.increment_covariance = sigma.cwiseAbs2().asDiagonal();
    pose_error_ = (o.transition * pose_error_).eval();
    for (Eigen::Index i = 0; i < 6; ++i) pose_error_[i] += sigma[i] * dice_.normal();
    pose_covariance_ =
        (o.transition * pose_covariance_ * o.transition.transpose() + o.increment_covariance)
            .eval();
  }
  o.covariance.topLeftCorner<6, 6>() = pose_covariance_;
  o.T_WB = boxPlus(T_WB, pose_error_);
  last_T_WB_ = T_WB;
  return o;
}

void World::computeVisibility(WorldFrame& frame) {
  ScratchVector<Outline> outlines;
  const double W = camera_.width(), H = camera_.height();
  for (std::size_t i = 0; i < things_.size(); ++i) {
    Outline o;
    o.id = i + 1;
    o.solidity = options_.hiding ? 1.0 : 0.0;
    const State x = things_[i].at(frame.t_s);
    o.distance_m = (x.head<3>() - frame.true_view.T_WC().p).norm();
    o.extent_m = 0.5 * x.segment<3>(kSize).array().exp().maxCoeff();
    o.box = projectOutline(x, frame.true_view);
    if (o.box && sizeOf(o.box->sides) >= things_[i].comes_out_px) errors_[i].out = true;
    if (!present(i, frame.t_s)) o.box.reset();
    std::optional<Box> inside;
    if (o.box) {
      const auto& s = o.box->sides;
      const Box cut{std::clamp(s[0], 0.0, W), std::clamp(s[1], 0.0, H), std::clamp(s[2], 0.0, W),
                    std::clamp(s[3], 0.0, H)};
      if (cut.width() >= 1.0 && cut.height() >= 1.0) inside = cut;
    }
    frame.outlines.push_back(inside);
    outlines.push_back(std::move(o));
  }
  frame.visibilities =
      semantic_filter::computeVisibility(outlines, {}, W, H, told_.config.filter.visibility);
}

void World::changeView(std::size_t thing, const State& x, const RigidTransform& T_WC) {
  Errors& e = errors_[thing];
  const Parameters& p = told_.config.filter;
  const auto keep = [&](const ViewScales& scales) {
    return e.last_T_WC ? viewCorrelation(x.head<3>(), *e.last_T_WC, T_WC, scales) : 0.0;
  };
  e.box.draw(dice_, keep({p.box.bias_angle, p.box.bias_log_distance, p.box.bias_image_angle}));
  e.noise_stays *= keep({p.box.noise_view, p.box.noise_view, 0.5 * p.box.noise_view});
  e.looks.draw(dice_, keep({p.tempering.angle, p.tempering.log_distance, p.tempering.image_angle}));
  if (!dice_.chance(keep({p.visibility.occluder_angle, kNever, kNever}))) {
    e.unmapped_occluder = dice_.chance(p.visibility.unmapped_occluder);
  }
  const double stays =
      keep({p.visibility.detectability_angle, p.visibility.detectability_log_distance, kNever});
  if (!elusive_dice_.chance(stays)) {
    e.hard_to_detect = elusive_dice_.chance(p.visibility.hard_to_detect);
  }
  e.last_T_WC = T_WC;
}

std::vector<float> World::activations(std::size_t class_index, double size_px,
                                      const Eigen::VectorXd& shared) {
  const sim::DetectorModel& d = told_.detector;
  const double correlation =
      options_.shared_looks ? told_.config.filter.tempering.correlation : 0.0;
  const double ease = 1.0 / (1.0 + std::exp(-std::log2(size_px / d.half_size_px) / d.size_octaves));
  const double separation = d.separation * (d.least_separation + (1.0 - d.least_separation) * ease);
  Eigen::VectorXd feature(directions_.cols());
  for (Eigen::Index i = 0; i < feature.size(); ++i) {
    const double own = shared.size() > 0 ? shared[i + kMoreErrors] : dice_.normal();
    feature[i] = std::sqrt(correlation) * own + std::sqrt(1.0 - correlation) * dice_.normal();
  }
  if (class_index < d.classes.size()) {
    feature += separation * directions_.row(static_cast<Eigen::Index>(class_index)).transpose();
  }
  std::vector<float> values{0.0F};
  for (Eigen::Index k = 0; k < directions_.rows(); ++k) {
    values.push_back(static_cast<float>(separation * directions_.row(k).dot(feature) -
                                        0.5 * separation * separation));
  }
  return values;
}

/// Adds the errors of the filter's model and of `measure`: b, which stays with the view, and noise.
Box World::withErrors(const Box& box, const std::vector<float>& activations, Errors& errors) {
  const double W = camera_.width(), H = camera_.height();
  const BoxParameters& p = told_.config.filter.box;
  BoxNoise noise = boxNoise(read_model_, W);
  double odds = 0.0;
  for (std::size_t k = 1; k < activations.size(); ++k) odds += std::exp(double(activations[k]));
  noise.clutter_probability = 1.0 / (1.0 + odds);
  const BoxMeasurement z = measure(box, W, H, p, noise);
  double scale = 1.0;  // factor of a Gaussian, in a draw of the t distribution
  if (options_.tail > 0.0) {
    double chi2 = 0.0;
    for (int i = 0; i < static_cast<int>(options_.tail); ++i) chi2 += std::pow(dice_.normal(), 2);
    scale = std::sqrt(options_.tail / chi2);
  }
  Eigen::Vector4d sides = z.sides;
  for (int i = 0; i < 4; ++i) {
    const double variance = z.variance[i] + (options_.lasting_errors ? 0.0 : z.lasting[i]);
    const double lasting =
        options_.lasting_errors ? std::sqrt(z.lasting[i]) * errors.box.values[i] : 0.0;
    const double stays = errors.noise_stays;
    errors.noise[i] = stays * errors.noise[i] + std::sqrt(1.0 - stays * stays) * dice_.normal();
    const double error = lasting + scale * std::sqrt(variance) * errors.noise[i];
    const double limit = i % 2 == 0 ? W : H;
    if (sides[i] > 0.0 && sides[i] < limit) sides[i] = std::clamp(sides[i] + error, 0.0, limit);
  }
  errors.noise_stays = 1.0;
  return {sides[0], sides[1], sides[2], sides[3]};
}

double World::azimuth(const Eigen::VectorXd& shared, double alpha) {
  const double sigma = told_.detector.azimuth_sigma;
  // The azimuth errors of different observations are less correlated than the other shared errors.
  const double correlation = std::pow(told_.config.filter.tempering.correlation, 2.0);
  const auto mixed = [&](Eigen::Index i) {
    return std::sqrt(correlation) * shared[i] + std::sqrt(1.0 - correlation) * dice_.normal();
  };
  if (normalCdf(mixed(kBlindAzimuth)) < kBlindShare) return dice_.uniform(-M_PI, M_PI);
  return wrapAngle(alpha + sigma * mixed(kAzimuth) + (dice_.chance(kFlipShare) ? M_PI : 0.0));
}

std::optional<Detection> World::look(std::size_t thing, const State& x, const WorldFrame& frame) {
  const TrackVisibility& visibility = frame.visibilities[thing];
  Errors& errors = errors_[thing];
  const auto projected = projectCuboid(x, frame.true_view);
  if (visibility.fraction <= 0.0 || !projected || !frame.outlines[thing]) return std::nullopt;
  if (errors.unmapped_occluder && options_.screens) return std::nullopt;
  const ClassPrior prior = told_.priors.of(things_[thing].class_name);
  const FrameContext context{
      frame.true_view, {}, &read_model_, &told_.priors, &told_.config.filter};
  const double size_px = sizeOf(projected->sides);
  if (!dice_.chance(visibility.fraction * detectionProbability(prior, size_px, context))) {
    return std::nullopt;
  }
  const bool hard_to_detect = errors.hard_to_detect && options_.screens;
  if (hard_to_detect &&
      !elusive_dice_.chance(told_.config.filter.visibility.hard_detection_share)) {
    return std::nullopt;
  }
  const Box box = *frame.outlines[thing];
  const auto own = std::find(model_.classes.begin(), model_.classes.end(), prior.name);
  auto index = static_cast<std::size_t>(own - model_.classes.begin());
  if (index == model_.classes.size()) {  // an unknown class is similar to clutter, or to one known
                                         // class
    const bool alike =
        normalCdf(errors.looks.values[kAlike]) < told_.config.filter.clutter.other_lookalike;
    if (alike) index = thing % model_.classes.size();
  }
  Detection d;
  d.activations = activations(index, std::sqrt(box.area()), errors.looks.values);
  d.box = withErrors(box, d.activations, errors);
  if (d.box.width() < 1.0 || d.box.height() < 1.0) return std::nullopt;
  const double reference = yawFromAzimuth(0.0, x.head<3>(), frame.true_view);
  if (options_.azimuths) d.azimuth = azimuth(errors.looks.values, wrapAngle(reference - x[kYaw]));
  d.azimuth_sigma = told_.detector.azimuth_sigma;
  return d;
}

/// Draws one axis of a false box by the model of logClutter. Each end is censored with the stated
/// probability. If one end is censored, the other is uniform; otherwise the size is log-uniform.
std::pair<double, double> World::falseExtent(double extent) {
  const ClutterParameters& clutter = told_.config.filter.clutter;
  const bool cut_low = dice_.chance(clutter.censored_probability);
  const bool cut_high = dice_.chance(clutter.censored_probability);
  if (cut_low && cut_high) return {0.0, extent};
  const double border = told_.config.filter.box.border_px;
  if (cut_low) return {0.0, dice_.uniform(border, extent)};
  if (cut_high) return {dice_.uniform(0.0, extent - border), extent};
  while (true) {
    const double low = std::log(clutter.min_size_px);
    const double half = 0.5 * std::exp(dice_.uniform(low, std::log(extent)));
    const double centre = dice_.uniform(0.0, extent);
    if (centre > half && centre + half < extent) return {centre - half, centre + half};
  }
}

void World::addClutter(std::vector<std::pair<Detection, int>>& boxes) {
  const double left = std::exp(-told_.config.filter.clutter.per_frame);
  // Poisson number by Knuth's method of products.
  for (double product = dice_.unit(); product > left; product *= dice_.unit()) {
    const auto [x1, x2] = falseExtent(camera_.width());
    const auto [y1, y2] = falseExtent(camera_.height());
    Detection d;
    d.box = {x1, y1, x2, y2};
    d.activations = activations(model_.classes.size(), std::sqrt(d.box.area()), {});
    if (options_.azimuths) d.azimuth = dice_.uniform(-M_PI, M_PI);
    d.azimuth_sigma = told_.detector.azimuth_sigma;
    boxes.emplace_back(std::move(d), -1);
  }
}

WorldFrame World::next() {
  WorldFrame frame;
  frame.t_s = static_cast<double>(frame_) / options_.rate_hz;
  frame.odometry = odometry(frame_, frame.t_s);
  frame.true_view.camera = &camera_;
  frame.true_view.T_WB = truePose(frame.t_s);
  computeVisibility(frame);
  frame.detections.stamp = frame.odometry.stamp;
  frame.detections.camera = "cam0";
  frame.detections.instance = 3;
  frame.detections.model_hash = model_.hash;
  std::vector<std::pair<Detection, int>> boxes;
  const RigidTransform T_WC = frame.true_view.T_WC();
  for (std::size_t i = 0; i < things_.size(); ++i) {
    if (!frame.outlines[i]) continue;
    const State x = things_[i].at(frame.t_s);
    changeView(i, x, T_WC);
    auto box = look(i, x, frame);
    if (box) boxes.emplace_back(std::move(*box), static_cast<int>(i));
  }
  if (options_.clutter) addClutter(boxes);
  std::sort(boxes.begin(), boxes.end(), [](const auto& a, const auto& b) {
    // sorted, so that the order does not depend on the origins
    return a.first.box.x1 < b.first.box.x1;
  });
  for (auto& [box, origin] : boxes) {
    frame.detections.detections.push_back(std::move(box));
    frame.origins.push_back(origin);
  }
  ++frame_;
  return frame;
}

}  // namespace perdure::test
