#include "tools/pipeline/odometry_source.h"

#include "common/math/so3.h"

namespace perdure::tools {
namespace {

Matrix9d declaredCovariance(const PoseAccuracy& accuracy) {
  Eigen::Matrix<double, 9, 1> sigma;
  sigma << Eigen::Vector3d::Constant(accuracy.sigma_rotation),
      Eigen::Vector3d::Constant(accuracy.sigma_position),
      Eigen::Vector3d::Constant(accuracy.sigma_velocity);
  return sigma.cwiseAbs2().asDiagonal();
}

Eigen::Matrix<double, 6, 1> leastStep() {
  Eigen::Matrix<double, 6, 1> sigma;
  sigma << Eigen::Vector3d::Constant(kLeastStepRotation),
      Eigen::Vector3d::Constant(kLeastStepPosition);
  return sigma.cwiseAbs2();
}

}  // namespace

PoseOdometry::PoseOdometry(replay::PoseFile poses, InstanceId instance, const WorldId& session,
                           PoseAccuracy accuracy)
    : poses_(std::move(poses)), instance_(instance), session_(session), accuracy_(accuracy) {}

std::optional<Odometry> PoseOdometry::at(const FrameStamp& stamp) {
  const auto T_WB = poses_.at(stamp.sequence, stamp.time);
  if (!T_WB) return std::nullopt;
  Odometry odometry;
  odometry.stamp = stamp;
  odometry.instance = instance_;
  odometry.world = session_;
  odometry.state = OdometryState::kTracking;
  odometry.T_WB = *T_WB;
  odometry.covariance = declaredCovariance(accuracy_);
  up_sum_ += accuracy_.z_up ? Eigen::Vector3d(Eigen::Vector3d::UnitZ())
                            : T_WB->q * Eigen::Vector3d::UnitZ();
  if (up_sum_.norm() > 1e-6) odometry.up_W = up_sum_.normalized();
  if (last_ && stamp.time > last_->stamp.time) {
    odometry.v_WB = (T_WB->p - last_->T_WB.p) / toSeconds(stamp.time - last_->stamp.time);
  }
  if (last_ && (accuracy_.bounded || poses_.hasSteps())) addIncrement(odometry);
  last_ = odometry;
  return odometry;
}

/// Adds the increment's transition and covariance. A bounded error is constant in W; its rotation
/// part is in body axes, so the transition rotates it. For other poses, the rotation error also
/// turns the step, and the step has an error of its own.
void PoseOdometry::addIncrement(Odometry& odometry) const {
  const RigidTransform& before = last_->T_WB;
  odometry.has_increment = true;
  odometry.increment_from = last_->stamp.sequence;
  odometry.transition.topLeftCorner<3, 3>() =
      (odometry.T_WB.q.conjugate() * before.q).toRotationMatrix();
  if (accuracy_.bounded) return;
  odometry.transition.bottomLeftCorner<3, 3>() = -skew(odometry.T_WB.p - before.p) * before.R();
  odometry.increment_covariance = poses_.errorOfSteps(last_->stamp, odometry.stamp);
  odometry.increment_covariance.diagonal() += leastStep();
  const Matrix6d& F = odometry.transition;
  odometry.covariance.topLeftCorner<6, 6>() =
      F * last_->covariance.topLeftCorner<6, 6>() * F.transpose() + odometry.increment_covariance;
}

}  // namespace perdure::tools
