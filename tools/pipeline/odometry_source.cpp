#include "tools/pipeline/odometry_source.h"

namespace perdure::tools {
namespace {

Matrix9d declaredCovariance(const PoseAccuracy& accuracy) {
  Eigen::Matrix<double, 9, 1> sigma;
  sigma << Eigen::Vector3d::Constant(accuracy.sigma_rotation),
      Eigen::Vector3d::Constant(accuracy.sigma_position),
      Eigen::Vector3d::Constant(accuracy.sigma_velocity);
  return sigma.cwiseAbs2().asDiagonal();
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
  if (accuracy_.bounded && last_) addIncrement(odometry);
  last_ = odometry;
  return odometry;
}

/// The error is constant in W. The rotation error is in body axes, so it rotates relative to W.
void PoseOdometry::addIncrement(Odometry& odometry) const {
  odometry.has_increment = true;
  odometry.increment_from = last_->stamp.sequence;
  odometry.transition.topLeftCorner<3, 3>() =
      (odometry.T_WB.q.conjugate() * last_->T_WB.q).toRotationMatrix();
}

}  // namespace perdure::tools
