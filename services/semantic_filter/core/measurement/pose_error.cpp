#include "services/semantic_filter/core/measurement/pose_error.h"

namespace perdure::semantic_filter {
namespace {

/// A random walk by distance travelled.
struct PoseWalk {
  double rotation = 0.0;  // rad/√m
  double position = 0.0;  // m/√m
};

/// The walk that stands in for what the odometry says of its own error; nothing where its own
/// transition and covariance are used.
std::optional<PoseWalk> poseWalkOf(const Odometry& odometry, const PoseParameters& pose) {
  if (!odometry.has_increment) return PoseWalk{pose.walk_rotation, pose.walk_position};
  if (pose.drift_position <= 0.0 || odometry.increment_covariance.isZero(0.0)) return std::nullopt;
  return PoseWalk{pose.drift_rotation, pose.drift_position};
}

}  // namespace

void advancePoseError(PoseError& error, const Odometry& odometry,
                      const std::optional<RigidTransform>& last_T_WB,
                      const PoseParameters& parameters) {
  const auto walk = poseWalkOf(odometry, parameters);
  error.reported = !walk;
  if (!walk) {
    error.covariance = odometry.covariance.topLeftCorner<6, 6>();
    error.product = (odometry.transition * error.product).eval();
    return;
  }
  if (!last_T_WB) return;
  // The error of rotation is expressed in the body, which turns against W.
  Matrix6d A = Matrix6d::Identity();
  A.topLeftCorner<3, 3>() = odometry.T_WB.R().transpose() * last_T_WB->R();
  Eigen::Matrix<double, 6, 1> q;
  q << Eigen::Vector3d::Constant(walk->rotation * walk->rotation),
      Eigen::Vector3d::Constant(walk->position * walk->position);
  const double metres = (odometry.T_WB.p - last_T_WB->p).norm();
  error.covariance = (A * error.covariance * A.transpose()).eval();
  error.covariance.diagonal() += metres * q;
  error.product = (A * error.product).eval();
}

}  // namespace perdure::semantic_filter
