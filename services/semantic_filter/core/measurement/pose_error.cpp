#include "services/semantic_filter/core/measurement/pose_error.h"

namespace perdure::semantic_filter {
namespace {

/// Nothing that was driven adds an error.
bool isExact(const Odometry& odometry) {
  return odometry.has_increment && odometry.increment_covariance.isZero(0.0);
}

}  // namespace

void advancePoseError(PoseError& error, const Odometry& odometry,
                      const std::optional<RigidTransform>& last_T_WB,
                      const PoseParameters& parameters) {
  error.reported = isExact(odometry);
  if (error.reported) {
    error.covariance = odometry.covariance.topLeftCorner<6, 6>();
    error.product = (odometry.transition * error.product).eval();
    return;
  }
  if (!last_T_WB) return;
  // The error of rotation is expressed in the body, which turns against W.
  Matrix6d A = Matrix6d::Identity();
  A.topLeftCorner<3, 3>() = odometry.T_WB.R().transpose() * last_T_WB->R();
  Eigen::Matrix<double, 6, 1> q;
  q << Eigen::Vector3d::Constant(parameters.walk_rotation * parameters.walk_rotation),
      Eigen::Vector3d::Constant(parameters.walk_position * parameters.walk_position);
  const double metres = (odometry.T_WB.p - last_T_WB->p).norm();
  error.covariance = (A * error.covariance * A.transpose()).eval();
  error.covariance.diagonal() += metres * q;
  error.product = (A * error.product).eval();
}

}  // namespace perdure::semantic_filter
