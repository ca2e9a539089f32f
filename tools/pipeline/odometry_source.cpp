#include "tools/pipeline/odometry_source.h"

namespace perdure::tools {
namespace {

constexpr double kSigmaRotation = 2e-3, kSigmaPosition = 0.02, kSigmaVelocity = 0.2;

Matrix9d declaredCovariance() {
  Eigen::Matrix<double, 9, 1> sigma;
  sigma << Eigen::Vector3d::Constant(kSigmaRotation), Eigen::Vector3d::Constant(kSigmaPosition),
      Eigen::Vector3d::Constant(kSigmaVelocity);
  return sigma.cwiseAbs2().asDiagonal();
}

}  // namespace

PoseOdometry::PoseOdometry(replay::PoseFile poses, InstanceId instance)
    : poses_(std::move(poses)), instance_(instance) {}

std::optional<Odometry> PoseOdometry::at(const FrameStamp& stamp) {
  const auto T_WB = poses_.at(stamp.sequence, stamp.time);
  if (!T_WB) return std::nullopt;
  Odometry odometry;
  odometry.stamp = stamp;
  odometry.instance = instance_;
  odometry.world = {1, 0};
  odometry.state = OdometryState::kTracking;
  odometry.T_WB = *T_WB;
  odometry.covariance = declaredCovariance();
  up_sum_ += T_WB->q * Eigen::Vector3d::UnitZ();
  if (up_sum_.norm() > 1e-6) odometry.up_W = up_sum_.normalized();
  if (last_ && stamp.time > last_->stamp.time) {
    odometry.v_WB = (T_WB->p - last_->T_WB.p) / toSeconds(stamp.time - last_->stamp.time);
  }
  last_ = odometry;
  return odometry;
}

}  // namespace perdure::tools
