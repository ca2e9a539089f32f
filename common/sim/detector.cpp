#include "common/sim/detector.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>

#include "common/base/errors.h"
#include "common/math/chi2.h"
#include "common/math/so3.h"

namespace perdure::sim {
namespace {

double logistic(double x) { return 1.0 / (1.0 + std::exp(-x)); }
double normalCdf(double x) { return 0.5 * std::erfc(-x / std::sqrt(2.0)); }

double sizeOf(const Box& box) { return std::sqrt(std::max(0.0, box.area())); }

/// KITTI's alpha in the levelled camera frame: yaw about the vertical minus the bearing of the
/// centre.
double alphaOf(const RigidTransform& T_WC, const Eigen::Vector3d& centre_W, double yaw) {
  const Eigen::Vector3d down = -Eigen::Vector3d::UnitZ(), optical = T_WC.R().col(2);
  const Eigen::Vector3d forward = (optical - optical.dot(down) * down).normalized();
  const Eigen::Vector3d right = down.cross(forward), ray = centre_W - T_WC.p;
  const Eigen::Vector3d axis(std::cos(yaw), std::sin(yaw), 0.0);
  return wrapAngle(std::atan2(-axis.dot(forward), axis.dot(right)) -
                   std::atan2(ray.dot(right), ray.dot(forward)));
}

[[noreturn]] void refuse(const std::string& what) {
  throw StartupError(ExitCode::kConfiguration, "the simulated detector's " + what);
}

void checkModel(const DetectorModel& m) {
  const auto share = [](double value) { return value >= 0.0 && value <= 1.0; };
  if (m.classes.empty()) refuse("classes are none; name at least one");
  if (!share(m.found) || !share(m.flip_share) || !share(m.persistent_share) ||
      !share(m.least_separation) || !share(m.side_correlation) || !share(m.shrink_below) ||
      !share(m.tail_share)) {
    refuse("shares are not within 0 and 1; fix that value");
  }
  if (!(m.half_size_px > 0 && m.size_octaves > 0 && m.visible_softness > 0 &&
        m.false_smallest_px > 0 && m.azimuth_sigma > 0 && m.separation > 0)) {
    refuse("sizes, softnesses, separation or azimuth_sigma are not above 0; fix that value");
  }
  if (!(m.box_share >= 0 && m.box_floor_px >= 0 && m.false_per_frame >= 0 &&
        m.false_per_frame <= 100 && m.latency_s >= 0)) {
    refuse("box errors, latency or false alarms are below 0 (or over 100 a frame); fix that value");
  }
  if (!(m.tail_scale >= 1 && m.error_time_s >= 0 && m.coast_s >= 0)) {
    refuse("tail_scale is below 1, or error_time or coast below 0; change the one that is");
  }
}

}  // namespace

Eigen::MatrixXd classDirections(const DetectorModel& model) {
  const auto count = static_cast<Eigen::Index>(model.classes.size());
  Eigen::MatrixXd cosines = Eigen::MatrixXd::Identity(count, count);
  const auto indexOf = [&](const std::string& name) {
    const auto found = std::ranges::find(model.classes, name);
    if (found == model.classes.end()) refuse("confusion names " + name + ", which is no class");
    return found - model.classes.begin();
  };
  for (const ConfusionPair& pair : model.confusion) {
    if (!(pair.share > 0.0 && pair.share < 0.5)) refuse("confusion is not within 0 and 0.5");
    const auto i = indexOf(pair.first), j = indexOf(pair.second);
    // Half the distance of two unit Gaussians is the quantile of their confusion probability.
    const double half = std::sqrt(chi2Quantile(1.0 - 2.0 * pair.share, 1)) / model.separation;
    cosines(i, j) = cosines(j, i) = std::max(0.0, 1.0 - 2.0 * half * half);
  }
  const Eigen::LLT<Eigen::MatrixXd> llt(cosines);
  if (llt.info() != Eigen::Success) {
    refuse("confusion cannot be: classes that are like a third one must be alike, too");
  }
  return llt.matrixL();
}

struct SimulatedDetector::Sight {
  TruthView view;
  double time_s = 0.0;
  std::size_t looks_like = 0;
  Box inside;            ///< what boxes enclose, within the image
  double visible = 0.0;  ///< visible fraction of the outline in the image
  Eigen::Vector3d centre_W = Eigen::Vector3d::Zero();
  double distance = 0.0, alpha = 0.0;
  double bearing = 0.0;  ///< direction of the camera, as seen from the object
};

/// Standard normal errors of one observation. One part is drawn for each frame. The other part is a
/// fixed function of object and viewpoint: a sum of waves with random phases. Its correlation
/// decreases as the viewpoint changes.
class SimulatedDetector::Errors {
 public:
  /// `time`: in time constants of the sides' errors; without it, sides are drawn for each frame.
  Errors(std::uint64_t seed, std::uint64_t frame, std::uint64_t object, double persistent,
         double bearing, double log_distance, std::optional<double> time = {})
      : fresh_(seedOf("look", {seed, frame, object})),
        own_(seedOf("object", {seed, object})),
        persistent_(persistent),
        time_(time) {
    constexpr std::array kTurns{2.0, 6.0, 12.0, 19.0};
    for (std::size_t i = 0; i < kTurns.size(); ++i) {
      const double phase = kTurns[i] * (bearing + log_distance);
      waves_[i] = {std::cos(phase), std::sin(phase)};
    }
  }
  double normal() { return withPersistent(fresh_.normal()); }
  /// The error of one side of the box; its drawn part changes with the time constant.
  double side() {
    if (!time_) return normal();
    double lasting = 0.0;
    for (std::size_t i = 0; i < waves_.size(); ++i) {
      // Cauchy-distributed frequencies have the correlation exp(−|Δt| / time constant).
      const double phase = *time_ * std::tan(M_PI * (own_.unit() - 0.5));
      const double a = own_.normal(), b = own_.normal();
      lasting += 0.5 * (std::cos(phase) * a + std::sin(phase) * b);
    }
    return withPersistent(lasting);
  }

 private:
  double withPersistent(double drawn) {
    double own = 0.0;
    for (const auto& wave : waves_) {
      const double a = own_.normal(), b = own_.normal();
      own += 0.5 * (wave[0] * a + wave[1] * b);  // four waves with a total variance of one
    }
    return std::sqrt(1.0 - persistent_) * drawn + std::sqrt(persistent_) * own;
  }

  Dice fresh_, own_;
  double persistent_;
  std::optional<double> time_;
  std::array<std::array<double, 2>, 4> waves_{};
};

SimulatedDetector::SimulatedDetector(DetectorModel model, Truth truth,
                                     const CameraCalibration& camera)
    : model_(std::move(model)),
      truth_(std::move(truth)),
      camera_(camera),
      width_(camera.width),
      height_(camera.height) {
  checkModel(model_);
  if (model_.coast_s > 0.0 && !(camera.rate_hz > 0.0)) {
    refuse("coast needs the camera's rate; give rate_hz in its sensor.yaml");
  }
  means_ = classDirections(model_);
  info_.name = "simulated";
  info_.classes = model_.classes;
  info_.input_width = camera.width;
  info_.input_height = camera.height;
  info_.box_sigma = model_.box_share;
  info_.boxes = model_.declare_boxes ? model_.boxes : BoxExtent::kUnknown;
  std::string all;
  for (const std::string& name : model_.classes) all += name + ",";
  info_.hash = digest(all + std::to_string(model_.seed));
}

double SimulatedDetector::foundProbability(double size_px, double visible) const {
  if (visible < model_.least_visible || size_px <= 0.0) return 0.0;
  return model_.found * logistic(std::log2(size_px / model_.half_size_px) / model_.size_octaves) *
         logistic((visible - model_.half_visible) / model_.visible_softness);
}

/// The box that the detector reports, within the image. If the camera model cannot project the
/// whole cuboid, the box of the outline.
Box SimulatedDetector::extentOf(const TruthView& view, const TruthObject& object,
                                const TruthKey& key, const RigidTransform& T_WC) const {
  const Box outline = view.boxInside(width_, height_);
  if (model_.boxes == BoxExtent::kOutline) return outline;
  const RigidTransform T_CO =
      T_WC.inverse() * RigidTransform(expQuaternion({0, 0, key.yaw}), key.centre_W);
  Box box{1e9, 1e9, -1e9, -1e9};
  for (int i = 0; i < 8; ++i) {
    const Eigen::Vector3d corner(i & 1 ? 0.5 : -0.5, i & 2 ? 0.5 : -0.5, i & 4 ? 0.5 : -0.5);
    const auto pixel = camera_.project(T_CO * corner.cwiseProduct(object.size));
    if (!pixel) return outline;
    box.x1 = std::min(box.x1, pixel->x()), box.x2 = std::max(box.x2, pixel->x());
    box.y1 = std::min(box.y1, pixel->y()), box.y2 = std::max(box.y2, pixel->y());
  }
  return clipped(box, width_, height_);
}

const TruthView* SimulatedDetector::viewOf(std::uint64_t frame, std::uint64_t object) const {
  const auto views = truth_.views.find(frame);
  if (views == truth_.views.end()) return nullptr;
  const auto view = std::ranges::find(views->second, object, &TruthView::object_id);
  return view == views->second.end() ? nullptr : &*view;
}

double SimulatedDetector::visibleShare(const TruthView& view) const {
  const double inside = view.boxInside(width_, height_).area() / view.box.area();
  return inside > 0.0 ? std::min(1.0, view.visible_fraction / inside) : 0.0;
}

/// Gives a hidden object the visibility of its last visible frame, and extrapolates its box.
void SimulatedDetector::coast(Sight& sight, std::uint64_t frame) const {
  const std::uint64_t id = sight.view.object_id;
  const double most =
      std::min(model_.coast_s * camera_.calibration().rate_hz + 1e-9, static_cast<double>(frame));
  for (std::uint64_t age = 1; static_cast<double>(age) <= most; ++age) {
    const TruthView* last = viewOf(frame - age, id);
    if (!last) return;
    if (visibleShare(*last) < model_.half_visible) continue;
    const TruthView* before = age < frame ? viewOf(frame - age - 1, id) : nullptr;
    const Box outline = sight.view.boxInside(width_, height_);
    const auto predicted = [&](double Box::*side) {
      const double speed = before ? last->box.*side - before->box.*side : 0.0;
      const double beyond_outline = sight.inside.*side - outline.*side;
      return last->box.*side + static_cast<double>(age) * speed + beyond_outline;
    };
    sight.visible = visibleShare(*last);
    sight.inside = clipped(
        {predicted(&Box::x1), predicted(&Box::y1), predicted(&Box::x2), predicted(&Box::y2)},
        width_, height_);
    return;
  }
}

std::vector<SimulatedDetector::Sight> SimulatedDetector::sights(std::uint64_t frame, TimePoint time,
                                                                const RigidTransform& T_WC) const {
  std::vector<Sight> result;
  const auto views = truth_.views.find(frame);
  if (views == truth_.views.end()) return result;
  for (const TruthView& view : views->second) {
    const auto object = std::ranges::find(truth_.objects, view.object_id, &TruthObject::id);
    if (object == truth_.objects.end() || !object->presentAt(time)) continue;
    const auto like = std::ranges::find(model_.classes, object->looks_like);
    Sight sight;
    sight.view = view;
    sight.time_s = toSeconds(time);
    sight.looks_like = static_cast<std::size_t>(like - model_.classes.begin());
    if (view.boxInside(width_, height_).area() <= 0.0) continue;
    sight.visible = visibleShare(view);
    const TruthKey key = object->at(time);
    sight.inside = extentOf(view, *object, key, T_WC);
    if (sight.visible < model_.half_visible) coast(sight, frame);
    const Eigen::Vector3d back = T_WC.p - key.centre_W;
    sight.centre_W = key.centre_W;
    sight.distance = back.norm();
    sight.bearing = wrapAngle(std::atan2(back.y(), back.x()) - key.yaw);
    sight.alpha = alphaOf(T_WC, key.centre_W, key.yaw);
    result.push_back(sight);
  }
  return result;
}

Detections SimulatedDetector::detect(std::uint64_t frame, const FrameStamp& stamp,
                                     const RigidTransform& T_WB) const {
  Detections found;
  found.stamp = stamp;
  found.camera = "cam0";
  found.instance = info_.instance;
  found.model_hash = info_.hash;
  const std::vector<Sight> all = sights(frame, stamp.time, T_WB * camera_.T_BC());
  for (const Sight& sight : all) {
    // The detector has no such class.
    if (sight.looks_like == model_.classes.size()) continue;
    if (auto detection = look(sight, all, frame)) found.detections.push_back(std::move(*detection));
  }
  Dice dice(seedOf("false alarms", {model_.seed, frame}));
  double left = std::exp(-model_.false_per_frame);  // Poisson-distributed, by Knuth's method
  for (double product = dice.unit(); product > left; product *= dice.unit()) {
    found.detections.push_back(falseAlarm(dice));
  }
  // Sorts, so that the order contains no information about identities.
  std::ranges::sort(found.detections, [](const Detection& a, const Detection& b) {
    return std::tie(a.box.x1, a.box.y1, a.box.x2) < std::tie(b.box.x1, b.box.y1, b.box.x2);
  });
  return found;
}

std::optional<Detection> SimulatedDetector::look(const Sight& sight, const std::vector<Sight>& all,
                                                 std::uint64_t frame) const {
  Errors errors(
      model_.seed, frame, sight.view.object_id, model_.persistent_share, sight.bearing,
      std::log(std::max(sight.distance, 0.1)),
      model_.error_time_s > 0.0 ? std::optional(sight.time_s / model_.error_time_s) : std::nullopt);
  const double size = sizeOf(sight.inside);
  const bool is_found = normalCdf(errors.normal()) < foundProbability(size, sight.visible);
  Detection detection;
  detection.activations = activations(sight.looks_like, quality(size, sight.visible), errors);
  if (model_.azimuth) {
    const double error = model_.azimuth_sigma * errors.normal();
    const bool flipped = normalCdf(errors.normal()) < model_.flip_share;
    detection.azimuth = wrapAngle(sight.alpha + error + (flipped ? M_PI : 0.0));
    detection.azimuth_sigma = model_.azimuth_sigma;
  }
  const auto box = withErrors(visiblePart(sight, all), errors);
  if (!is_found || !box) return std::nullopt;
  detection.box = *box;
  return detection;
}

/// The visible part of the box: the nearer object with the largest overlap hides one side. If no
/// object overlaps, the object's id determines the hidden side.
Box SimulatedDetector::visiblePart(const Sight& sight, const std::vector<Sight>& all) const {
  Box box = sight.inside;
  if (sight.visible >= model_.shrink_below) return box;
  double across = 0.0, most = 0.0;
  for (const Sight& other : all) {
    if (other.distance >= sight.distance) continue;
    const double w = std::min(box.x2, other.inside.x2) - std::max(box.x1, other.inside.x1);
    const double h = std::min(box.y2, other.inside.y2) - std::max(box.y1, other.inside.y1);
    if (w <= 0 || h <= 0 || w * h <= most) continue;
    most = w * h;
    across = 0.5 * (other.inside.x1 + other.inside.x2 - box.x1 - box.x2) / box.width();
  }
  const auto any = seedOf("hidden side", {model_.seed, sight.view.object_id}) % 3;
  const bool known = most > 0.0;
  const double left = 1.0 - std::max(sight.visible, 0.05);
  if (known ? across < -0.15 : any == 0) {
    box.x1 += left * box.width();
  } else if (known ? across > 0.15 : any == 1) {
    box.x2 -= left * box.width();
  } else {
    box.y2 -= left * box.height();
  }
  return box;
}

std::optional<Box> SimulatedDetector::withErrors(const Box& box, Errors& errors) const {
  const double common = std::sqrt(model_.side_correlation);
  const double own = std::sqrt(1.0 - model_.side_correlation);
  const double sigma_x = std::hypot(model_.box_share * box.width(), model_.box_floor_px);
  const double sigma_y = std::hypot(model_.box_share * box.height(), model_.box_floor_px);
  const double shift_x = common * errors.side(), shift_y = common * errors.side();
  const auto side = [&](double at, double shift, double sigma, double limit) {
    double error = sigma * (shift + own * errors.side());
    if (model_.tail_share > 0.0 && normalCdf(errors.side()) < model_.tail_share)
      error *= model_.tail_scale;
    // A side cut by the image border stays at the border.
    if (at <= 0.0 || at >= limit) return at;
    return std::clamp(at + error, 0.0, limit);
  };
  Box noisy;
  noisy.x1 = side(box.x1, shift_x, sigma_x, width_);
  noisy.x2 = side(box.x2, shift_x, sigma_x, width_);
  noisy.y1 = side(box.y1, shift_y, sigma_y, height_);
  noisy.y2 = side(box.y2, shift_y, sigma_y, height_);
  if (noisy.width() < 1.0 || noisy.height() < 1.0) return std::nullopt;
  return noisy;
}

/// Returns 1 for large and visible objects, down to least_separation for barely detectable ones.
double SimulatedDetector::quality(double size_px, double visible) const {
  const double ease = foundProbability(size_px, visible) / std::max(model_.found, 1e-9);
  return model_.least_separation + (1.0 - model_.least_separation) * ease;
}

std::vector<float> SimulatedDetector::activations(std::size_t truth, double quality,
                                                  Errors& errors) const {
  const Eigen::Index count = means_.rows();
  const double separation = model_.separation * quality;
  Eigen::VectorXd feature(count);
  for (Eigen::Index i = 0; i < count; ++i) feature[i] = errors.normal();
  if (truth < model_.classes.size()) {
    feature += separation * means_.row(static_cast<Eigen::Index>(truth)).transpose();
  }
  std::vector<float> values{0.0F};
  for (Eigen::Index k = 0; k < count; ++k) {
    const double ratio = separation * means_.row(k).dot(feature) - 0.5 * separation * separation;
    values.push_back(static_cast<float>(ratio));
  }
  return values;
}

Detection SimulatedDetector::falseAlarm(Dice& dice) const {
  const double low = std::log(model_.false_smallest_px);
  const double w = std::exp(dice.uniform(low, std::log(width_)));
  const double h = std::exp(dice.uniform(low, std::log(height_)));
  const double x = dice.uniform(0.0, std::max(width_ - w, 1.0));
  const double y = dice.uniform(0.0, std::max(height_ - h, 1.0));
  Detection detection;
  detection.box = {x, y, std::min(x + w, width_), std::min(y + h, height_)};
  Errors errors(model_.seed, dice.seed(), 0, 0.0, 0.0, 0.0);
  detection.activations =
      activations(model_.classes.size(), quality(sizeOf(detection.box), 1.0), errors);
  if (model_.azimuth) {
    detection.azimuth = dice.uniform(-M_PI, M_PI);
    detection.azimuth_sigma = model_.azimuth_sigma;
  }
  return detection;
}

}  // namespace perdure::sim
