#include "services/semantic_filter/core/tracks/cuboid_fit.h"

#include <ceres/tiny_solver.h>

#include <algorithm>
#include <cmath>

#include "common/math/gaussian.h"
#include "common/math/so3.h"
#include "services/semantic_filter/core/belief/pose_correlation.h"
namespace perdure::semantic_filter {

namespace {

/// Residual of a state without a projection, so large that the solver refuses the step.
constexpr double kNoStep = 1e100;

/// Whitened residuals: 4 sides, 3 position (weak), 1 yaw, 3 size, 1 range, 4 bias.
class CuboidCost {
 public:
  using Scalar = double;
  enum { NUM_RESIDUALS = 16, NUM_PARAMETERS = kFree };
  using Residuals = Eigen::Matrix<double, NUM_RESIDUALS, 1>;
  using Jacobian = Eigen::Matrix<double, NUM_RESIDUALS, NUM_PARAMETERS>;

  CuboidCost(const BoxDetection& detection, const ClassPrior& prior, double yaw, double yaw_sigma,
             const std::optional<RangeHint>& range, const FrameContext& frame,
             const Eigen::Vector3d& start)
      : z_(detection.z),
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

/// Returns the depth, m, at which an object of usual size has the height (or width) of the box.
std::optional<double> depthFromSize(const BoxMeasurement& z, const ClassPrior& prior,
                                    const CameraModel& camera) {
  if (z.measured[1] && z.measured[3]) return camera.fy() * std::exp(prior.log_size[2]) / z.height();
  if (z.measured[0] && z.measured[2]) {
    return camera.fx() * std::exp(0.5 * (prior.log_size[0] + prior.log_size[1])) / z.width();
  }
  return std::nullopt;
}

}  // namespace

std::optional<Eigen::Vector3d> centreRay(const BoxMeasurement& z, const View& view) {
  const Eigen::Vector2d centre(0.5 * (z.sides[0] + z.sides[2]), 0.5 * (z.sides[1] + z.sides[3]));
  const auto normalised = view.camera->unproject(centre);
  if (!normalised) return std::nullopt;
  const Eigen::Vector3d ray(normalised->x(), normalised->y(), 1.0);
  return Eigen::Vector3d(view.T_WC().R() * ray);
}

std::optional<RangeHint> rangeFromLandmarks(const BoxDetection& detection,
                                            const std::vector<LandmarkDepth>& points,
                                            const InitiationParameters& parameters) {
  const auto& z = detection.z;
  const Eigen::Vector2d centre(0.5 * (z.sides[0] + z.sides[2]), 0.5 * (z.sides[1] + z.sides[3]));
  double sum = 0.0, mean = 0.0, square = 0.0;
  std::int64_t n = 0;
  for (const auto& p : points) {
    const double u = (p.pixel.x() - centre.x()) / (0.5 * z.width());
    const double v = (p.pixel.y() - centre.y()) / (0.5 * z.height());
    if (std::abs(u) > 1.0 || std::abs(v) > 1.0 || p.distance_m <= 0.0) continue;
    const double weight = std::exp(-std::hypot(u, v) / parameters.landmark_decay) /
                          (1.0 + p.sigma_m * p.sigma_m / (p.distance_m * p.distance_m));
    const double inverse = 1.0 / p.distance_m;  // far landmarks count less in the mean of inverses
    sum += weight, mean += weight * inverse, square += weight * inverse * inverse;
    ++n;
  }
  if (n < parameters.min_landmarks) return std::nullopt;
  mean /= sum;
  const double spread = std::sqrt(std::max(square / sum - mean * mean, 0.0)) / mean;
  return RangeHint{1.0 / mean, (0.1 + spread) / mean};
}

std::optional<CuboidFit> fitCuboid(const BoxDetection& detection, const ClassPrior& prior,
                                   double yaw, double yaw_sigma,
                                   const std::optional<RangeHint>& range,
                                   const FrameContext& frame) {
  const auto ray = centreRay(detection.z, frame.view);
  if (!ray) return std::nullopt;
  const auto depth = range ? range->distance_m / ray->norm()
                           : depthFromSize(detection.z, prior, *frame.view.camera);
  if (!depth) return std::nullopt;
  const double minimum = frame.parameters->initiation.min_distance_m;
  const Eigen::Vector3d start = frame.view.T_WC().p + *ray * std::max(*depth, minimum);
  const CuboidCost cost(detection, prior, yaw, yaw_sigma, range, frame, start);
  VectorFit x = VectorFit::Zero();
  x.head<7>() << start, yaw, prior.log_size;
  CuboidCost::Residuals r;
  CuboidCost::Jacobian J;
  // The solver does not check its start.
  if (!cost(x.data(), r.data(), J.data())) return std::nullopt;
  ceres::TinySolver<CuboidCost> solver;
  solver.options.max_num_iterations = 15;
  solver.Solve(cost, &x);
  if (!x.allFinite() || !cost(x.data(), r.data(), J.data())) return std::nullopt;
  const Cholesky hessian(J.transpose() * J);
  if (!hessian.positive()) return std::nullopt;
  CuboidFit fit;
  fit.cost = 0.5 * r.squaredNorm();
  fit.hypothesis.class_name = prior.name;
  fit.hypothesis.x.head<kFree>() = x;
  fit.hypothesis.x[kYaw] = wrapAngle(x[kYaw]);
  fit.hypothesis.P.setZero();
  fit.hypothesis.P.topLeftCorner<kFree, kFree>() =
      hessian.solve(Eigen::Matrix<double, kFree, kFree>::Identity());
  addPoseError(fit.hypothesis, frame.view.T_WB, frame.view.up_W, frame.pose_error.covariance);
  if (!fit.hypothesis.P.allFinite()) return std::nullopt;
  return fit;
}

}  // namespace perdure::semantic_filter
