#include "services/semantic_filter/core/tracks/initiation.h"

#include <ceres/tiny_solver.h>

#include <algorithm>
#include <cmath>

#include "common/math/gaussian.h"
#include "common/math/so3.h"
#include "services/semantic_filter/core/belief/ground_surface.h"
#include "services/semantic_filter/core/update/track_update.h"

namespace perdure::semantic_filter {
namespace {

constexpr int kFree = kVelocity;  // dimensions of the fit: geometry and bias
using VectorFit = Eigen::Matrix<double, kFree, 1>;

/// Residuals where nothing is before the camera: the solver reads them of a step whose cost cannot
/// be told, and must not take it.
constexpr double kNoStep = 1e100;

/// Residuals: four sides, three of position (weak), one of yaw, three of size, one of range,
/// four of bias.
class BirthCost {
 public:
  using Scalar = double;
  enum { NUM_RESIDUALS = 16, NUM_PARAMETERS = kFree };
  using Residuals = Eigen::Matrix<double, NUM_RESIDUALS, 1>;
  using Jacobian = Eigen::Matrix<double, NUM_RESIDUALS, NUM_PARAMETERS>;

  BirthCost(const Evidence& evidence, const ClassPrior& prior, double yaw, double yaw_sigma,
            const std::optional<RangeHint>& range, const FrameContext& frame,
            const Eigen::Vector3d& start)
      : z_(evidence.z),
        from_(frame.projector()),
        yaw_(yaw),
        yaw_sigma_(yaw_sigma),
        range_(range),
        log_size_(prior.log_size),
        start_(start),
        style_(frame.styleOf(prior.name)) {
    bias_sigma_ = biasSigma(viewWalkOf(frame).lasting, z_.width(), z_.height()).cwiseMax(1e-6);
    position_weight_ = 1.0 / std::max((start - from_.T_WC.p).norm(), 1.0);
    size_whitening_ = Cholesky(prior.log_size_covariance).whiten(Eigen::Matrix3d::Identity());
  }

  bool operator()(const double* parameters, double* residuals, double* jacobian) const {
    State x = State::Zero();
    x.head<kFree>() = Eigen::Map<const VectorFit>(parameters);
    const auto box = projectObserved(x, from_, style_);
    Eigen::Map<Residuals> r(residuals);
    if (!box) {
      r.setConstant(kNoStep);
      return false;
    }
    Jacobian J = Jacobian::Zero();
    r.setZero();
    sides(*box, r, J);
    r.segment<3>(4) = position_weight_ * (x.head<3>() - start_);
    J.block<3, 3>(4, 0).diagonal().setConstant(position_weight_);
    r[7] = wrapAngle(x[kYaw] - yaw_) / yaw_sigma_;
    J(7, kYaw) = 1.0 / yaw_sigma_;
    r.segment<3>(8) = size_whitening_ * (x.segment<3>(kSize) - log_size_);
    J.block<3, 3>(8, kSize) = size_whitening_;
    if (range_) {
      const Eigen::Vector3d ray = x.head<3>() - from_.T_WC.p;
      r[11] = (ray.norm() - range_->distance_m) / range_->sigma_m;
      J.block<1, 3>(11, 0) = ray.normalized().transpose() / range_->sigma_m;
    }
    r.segment<4>(12) = x.segment<4>(kBias).cwiseQuotient(bias_sigma_);
    J.block<4, 4>(12, kBias).diagonal() = bias_sigma_.cwiseInverse();
    if (jacobian) std::copy(J.data(), J.data() + J.size(), jacobian);
    return r.allFinite();
  }

 private:
  void sides(const ProjectedBox& box, Eigen::Map<Residuals>& r, Jacobian& J) const {
    for (int i = 0; i < 4; ++i) {
      const double inside = i < 2 ? box.sides[i] - z_.sides[i] : z_.sides[i] - box.sides[i];
      if (!box.exact[i] || (!z_.measured[i] && inside <= 0.0)) continue;
      const double weight = 1.0 / std::sqrt(z_.variance[i]);
      r[i] = weight * (box.sides[i] - z_.sides[i]);
      J.row(i) = weight * box.H.row(i).head<kFree>();
    }
  }

  const BoxMeasurement& z_;
  Projector from_;
  double yaw_, yaw_sigma_;
  std::optional<RangeHint> range_;
  Eigen::Vector3d log_size_, start_;
  const BoxStyle& style_;
  double position_weight_ = 1.0;
  Eigen::Vector4d bias_sigma_;
  Eigen::Matrix3d size_whitening_;
};

/// Unit ray in W through the box's centre.
std::optional<Eigen::Vector3d> centreRay(const BoxMeasurement& z, const View& view) {
  const Eigen::Vector2d centre(0.5 * (z.sides[0] + z.sides[2]), 0.5 * (z.sides[1] + z.sides[3]));
  const auto normalised = view.camera->unproject(centre);
  if (!normalised) return std::nullopt;
  const Eigen::Vector3d ray(normalised->x(), normalised->y(), 1.0);
  return Eigen::Vector3d(view.T_WC().R() * ray);  // its length is per metre of depth
}

/// Depth at which an object of the prior's size has the box's height, or else its width.
std::optional<double> depthFromSize(const BoxMeasurement& z, const ClassPrior& prior,
                                    const CameraModel& camera) {
  if (z.measured[1] && z.measured[3]) return camera.fy() * std::exp(prior.log_size[2]) / z.height();
  if (z.measured[0] && z.measured[2]) {
    return camera.fx() * std::exp(0.5 * (prior.log_size[0] + prior.log_size[1])) / z.width();
  }
  return std::nullopt;
}

/// The pose error enters what was seen from the body: δp = δp_B + R [·]x θ, δψ = up · R θ.
void addPoseError(Hypothesis& h, const FrameContext& frame) {
  Eigen::Matrix<double, kStateDim, 6> A = Eigen::Matrix<double, kStateDim, 6>::Zero();
  const Eigen::Matrix3d R_WB = frame.view.T_WB.R();
  const Eigen::Vector3d p_B = frame.view.T_WB.inverse() * Eigen::Vector3d(h.x.head<3>());
  A.block<3, 3>(0, 0) = -R_WB * skew(p_B);
  A.block<3, 3>(0, 3).setIdentity();
  A.block<1, 3>(kYaw, 0) = frame.view.up_W.transpose() * R_WB;
  h.C = A * frame.pose_error.covariance;
  h.P += A * frame.pose_error.covariance * A.transpose();
  makeSymmetric(h.P);
}

struct YawStart {
  double yaw, sigma, weight;
};

/// Four starts that cover a half turn: the cuboid is the same when turned by 180°.
std::vector<YawStart> yawStarts(const ClassPrior& prior, const FrameContext& frame,
                                const Eigen::Vector3d& ray) {
  const Eigen::Vector3d level = levelling(frame.view.up_W) * ray;
  const double bearing = std::atan2(level.y(), level.x());
  if (!prior.has_yaw) return {{bearing, 1.0, 1.0}};
  std::vector<YawStart> starts;
  for (int i = 0; i < 4; ++i) starts.push_back({wrapAngle(bearing + i * M_PI / 4), 0.39, 0.25});
  return starts;
}

void addMovingTwin(Object& object, const Hypothesis& still, const ClassPrior& prior) {
  if (prior.moving <= 0.0 || prior.speed_sigma <= 0.0) return;
  Hypothesis twin = still;
  object.hypotheses.back().weight *= 1.0 - prior.moving;
  twin.weight *= prior.moving;
  twin.moving = true;
  const Eigen::Vector2d along(std::cos(twin.x[kYaw]), std::sin(twin.x[kYaw]));
  const double s2 = prior.speed_sigma * prior.speed_sigma;
  twin.P.block<2, 2>(kVelocity, kVelocity) =
      s2 * along * along.transpose() + 0.04 * s2 * Eigen::Matrix2d::Identity();
  twin.P(kVelocity + 2, kVelocity + 2) = 0.04;
  object.hypotheses.push_back(twin);
}

/// One azimuth alone may be far off: it counts half. It weighs the yaw starts
/// of a class among each other; the class's own weight does not change.
void weighByAzimuth(std::vector<Hypothesis>& fits, const Evidence& evidence,
                    const ClassPrior& prior, const FrameContext& frame) {
  if (!evidence.azimuth || !prior.has_yaw) return;
  const double sigma = azimuthSigma(evidence.azimuth_sigma, prior);
  double before = 0.0, after = 0.0;
  for (auto& h : fits) {
    before += h.weight;
    h.weight *= updateWithAzimuth(h, *evidence.azimuth, sigma, 0.5, frame);
    after += h.weight;
  }
  for (auto& h : fits) h.weight *= after > 0.0 ? before / after : 1.0;
}

/// How much better the box's shape (its aspect) fits what was assumed than clutter, whose extents
/// are log-uniform. Where sides are cut it has none.
double logShapeRatio(const Fit& fit, const ClassPrior& prior, double yaw_sigma,
                     const Evidence& evidence, const FrameContext& frame) {
  const auto& z = evidence.z;
  const auto box = projectObserved(fit.hypothesis.x, frame.projector(),
                                   frame.styleOf(fit.hypothesis.class_name));
  const bool whole = z.count() == 4 && box &&
                     std::all_of(box->exact.begin(), box->exact.end(), [](bool e) { return e; });
  if (!whole) return -fit.cost;
  using Row = Eigen::Matrix<double, 1, kFree>;
  const Row by_state = (box->H.row(2) - box->H.row(0)).head<kFree>() / z.width() -
                       (box->H.row(3) - box->H.row(1)).head<kFree>() / z.height();
  Eigen::Matrix<double, kFree, kFree> P = Eigen::Matrix<double, kFree, kFree>::Zero();
  P(kYaw, kYaw) = yaw_sigma * yaw_sigma;
  P.block<3, 3>(kSize, kSize) = prior.log_size_covariance;
  P.bottomRightCorner<4, 4>().diagonal() =
      biasSigma(viewWalkOf(frame).lasting, z.width(), z.height()).cwiseAbs2();
  const double noise = (z.variance[0] + z.variance[2]) / std::pow(z.width(), 2) +
                       (z.variance[1] + z.variance[3]) / std::pow(z.height(), 2);
  const double variance = (by_state * P).dot(by_state) + noise;
  const CameraModel& camera = *frame.view.camera;
  const double range =
      std::log(std::max(camera.width(), camera.height()) / frame.parameters->clutter.min_size_px);
  return -fit.cost - 0.5 * std::log(2.0 * M_PI * variance) + std::log(range);
}

/// How much better the thing's underside fits the ground than that of clutter does, whose boxes are
/// as likely anywhere in the image: 1 where nothing is known of the ground.
double groundRatio(Hypothesis& h, const FrameContext& frame) {
  const double log_ratio = standOnGround(h, 0, frame);
  if (log_ratio == 0.0) return 1.0;
  const CameraModel& camera = *frame.view.camera;
  const double distance = (h.x.head<3>() - frame.view.T_WC().p).norm();
  const double span = camera.height() * distance / camera.fy();
  return std::exp(log_ratio) * std::max(span / frame.parameters->ground.span_m, 1.0);
}

void addClass(Object& object, const ClassPrior& prior, double ratio, const Evidence& evidence,
              const std::vector<YawStart>& starts, const std::optional<RangeHint>& range,
              const FrameContext& frame) {
  std::vector<Hypothesis> fits;
  for (const auto& start : starts) {
    const auto fit = fitCuboid(evidence, prior, start.yaw, start.sigma, range, frame);
    if (!fit) continue;
    fits.push_back(fit->hypothesis);
    const double part = frame.parameters->box.part;
    const double shape = std::exp(logShapeRatio(*fit, prior, start.sigma, evidence, frame));
    const double ground = groundRatio(fits.back(), frame);
    fits.back().weight = ratio * start.weight * (part + (1.0 - part) * shape) * ground;
  }
  weighByAzimuth(fits, evidence, prior, frame);
  for (const auto& h : fits) {
    if (h.weight < 1e-15) continue;
    object.hypotheses.push_back(h);
    addMovingTwin(object, h, prior);
  }
}

/// "other" has three starts of size, so that each Gaussian is narrow enough to be linear in depth.
void addOther(Object& object, double ratio, const Evidence& evidence, const Eigen::Vector3d& ray,
              const std::optional<RangeHint>& range, const FrameContext& frame) {
  constexpr double kScales[3] = {-1.2, 0.0, 1.2};
  ClassPrior prior = frame.priors->other;
  const Eigen::Vector3d middle = prior.log_size;
  for (const double scale : kScales) {
    prior.log_size = middle.array() + scale;
    addClass(object, prior, ratio / 3.0, evidence, yawStarts(prior, frame, ray), range, frame);
  }
}

struct Candidate {
  ClassPrior prior;
  double log_weight;
};

std::vector<Candidate> candidates(const Evidence& evidence, const FrameContext& frame) {
  std::vector<Candidate> all;
  for (const auto& name : frame.model->classes) {
    ClassPrior prior = frame.priors->of(name);
    prior.name = name;
    all.push_back({prior, std::log(prior.frequency) + logRatio(evidence, *frame.model, name)});
  }
  std::stable_sort(all.begin(), all.end(),
                   [](const auto& a, const auto& b) { return a.log_weight > b.log_weight; });
  const auto& birth = frame.parameters->birth;
  const auto limit = static_cast<std::size_t>(birth.max_classes);
  if (all.size() > limit) all.resize(limit);
  const double floor = all.empty() ? 0.0 : all.front().log_weight + std::log(birth.class_ratio);
  std::erase_if(all, [&](const auto& c) { return c.log_weight < floor; });
  return all;
}

/// Sum of the classes' frequencies. A network with K classes spreads the prior over those that it
/// reports at all: bounded below by one class's share in ten.
double frequencies(const FrameContext& frame) {
  double sum = 0.0;
  for (const auto& name : frame.model->classes) sum += frame.priors->of(name).frequency;
  return std::max(std::min(sum, 10.0), 1e-9);
}

/// Sets existence by the weights, normalises them, and books both: what was expected before the
/// box, what the network says, and for the classes what the fits make of that.
void bookBirth(Object& object, const std::vector<Candidate>& kept, const Evidence& evidence,
               const FrameContext& frame) {
  const double odds = frame.parameters->birth.odds;
  double ratio = 0.0;
  for (const auto& h : object.hypotheses) ratio += h.weight;
  ratio *= odds;
  object.existence = {odds / (1.0 + odds), ExistenceEvidence::kPrior, object.as_of};
  object.existence.become(ratio / (1.0 + ratio), ExistenceEvidence::kHit, object.as_of);
  const double other = frame.parameters->clutter.other_prior;
  double frequency = 0.0, said_of_all = 0.0;
  for (const auto& c : kept) frequency += c.prior.frequency;
  std::vector<ClassNumber> prior = {{kOtherClass, std::log(other)}};
  std::vector<ClassNumber> said = {{kOtherClass, evidence.log_ratio_other}};
  for (const auto& c : kept) {
    prior.push_back({c.prior.name, std::log((1.0 - other) * c.prior.frequency / frequency)});
    said.push_back({c.prior.name, c.log_weight - std::log(c.prior.frequency)});
  }
  for (std::size_t i = 0; i < said.size(); ++i) {
    said_of_all += std::exp(prior[i].value + said[i].value);
  }
  for (auto& s : said) s.value -= std::log(said_of_all);
  normalise(object, ClassEvidence::kGeometry);
  object.classes.shift(ClassEvidence::kGeometry, ClassEvidence::kPrior, prior);
  object.classes.shift(ClassEvidence::kGeometry, ClassEvidence::kActivation, said);
}

}  // namespace

std::optional<RangeHint> rangeFromLandmarks(const Evidence& evidence,
                                            const std::vector<SightPoint>& points,
                                            const BirthParameters& parameters) {
  const auto& z = evidence.z;
  const Eigen::Vector2d centre(0.5 * (z.sides[0] + z.sides[2]), 0.5 * (z.sides[1] + z.sides[3]));
  double sum = 0.0, mean = 0.0, square = 0.0;
  std::int64_t n = 0;
  for (const auto& p : points) {
    const double u = (p.pixel.x() - centre.x()) / (0.5 * z.width());
    const double v = (p.pixel.y() - centre.y()) / (0.5 * z.height());
    if (std::abs(u) > 1.0 || std::abs(v) > 1.0 || p.distance_m <= 0.0) continue;
    const double weight = std::exp(-std::hypot(u, v) / parameters.landmark_decay) /
                          (1.0 + p.sigma_m * p.sigma_m / (p.distance_m * p.distance_m));
    const double inverse = 1.0 / p.distance_m;  // the mean of the inverse: far points pull less
    sum += weight, mean += weight * inverse, square += weight * inverse * inverse;
    ++n;
  }
  if (n < parameters.min_landmarks) return std::nullopt;
  mean /= sum;
  const double spread = std::sqrt(std::max(square / sum - mean * mean, 0.0)) / mean;
  return RangeHint{1.0 / mean, (0.1 + spread) / mean};
}

double logBirthRatio(const Evidence& evidence, const FrameContext& frame) {
  const auto& p = *frame.parameters;
  double sum = 0.0;
  for (const auto& name : frame.model->classes) {
    sum += frame.priors->of(name).frequency * std::exp(logRatio(evidence, *frame.model, name));
  }
  const double named = sum / frequencies(frame);
  return std::log(p.birth.odds) - evidence.log_remnants +
         std::log((1.0 - p.clutter.other_prior) * named +
                  p.clutter.other_prior * std::exp(evidence.log_ratio_other));
}

std::optional<Fit> fitCuboid(const Evidence& evidence, const ClassPrior& prior, double yaw,
                             double yaw_sigma, const std::optional<RangeHint>& range,
                             const FrameContext& frame) {
  const auto depth = depthFromSize(evidence.z, prior, *frame.view.camera);
  const auto ray = centreRay(evidence.z, frame.view);
  if (!depth || !ray) return std::nullopt;
  const double minimum = frame.parameters->birth.min_distance_m;
  const double start_depth = range ? range->distance_m / ray->norm() : *depth;
  const Eigen::Vector3d start = frame.view.T_WC().p + *ray * std::max(start_depth, minimum);
  const BirthCost cost(evidence, prior, yaw, yaw_sigma, range, frame, start);
  VectorFit x = VectorFit::Zero();
  x.head<7>() << start, yaw, prior.log_size;
  BirthCost::Residuals r;
  BirthCost::Jacobian J;
  if (!cost(x.data(), r.data(), J.data())) return std::nullopt;  // the solver would not ask
  ceres::TinySolver<BirthCost> solver;
  solver.options.max_num_iterations = 15;
  solver.Solve(cost, &x);
  if (!x.allFinite() || !cost(x.data(), r.data(), J.data())) return std::nullopt;
  const Cholesky hessian(J.transpose() * J);
  if (!hessian.positive()) return std::nullopt;
  Fit fit;
  fit.cost = 0.5 * r.squaredNorm();
  fit.hypothesis.class_name = prior.name;
  fit.hypothesis.x.head<kFree>() = x;
  fit.hypothesis.x[kYaw] = wrapAngle(x[kYaw]);
  fit.hypothesis.P.setZero();
  fit.hypothesis.P.topLeftCorner<kFree, kFree>() =
      hessian.solve(Eigen::MatrixXd::Identity(kFree, kFree));
  addPoseError(fit.hypothesis, frame);
  if (!fit.hypothesis.P.allFinite()) return std::nullopt;
  return fit;
}

std::optional<Object> bear(const Evidence& evidence, const std::optional<RangeHint>& range,
                           TimePoint now, const FrameContext& frame) {
  const auto ray = centreRay(evidence.z, frame.view);
  if (!ray) return std::nullopt;
  const auto kept = candidates(evidence, frame);
  Object object;
  const double other = frame.parameters->clutter.other_prior;
  const double named = (1.0 - other) / frequencies(frame);
  for (const auto& c : kept) {
    addClass(object, c.prior, named * std::exp(c.log_weight), evidence,
             yawStarts(c.prior, frame, *ray), range, frame);
  }
  addOther(object, other * std::exp(evidence.log_ratio_other), evidence, *ray, range, frame);
  if (object.hypotheses.empty()) return std::nullopt;
  object.first_seen = object.last_seen = object.as_of = now;
  object.pose_product = frame.pose_error.product;
  object.first_box = object.last_box = OwnBox{now, evidence.z.box()};
  object.hits = 1;
  object.asked = frame.model->names;
  bookBirth(object, kept, evidence, frame);
  object.alike = evidence.log_ratio_best;
  object.hit_view = object.late_view = {frame.view.T_WC(), 1.0};
  object.last_view = frame.view.T_WC();
  return object;
}

}  // namespace perdure::semantic_filter
