#include "common/mapping/frames/relative_error.h"

#include "common/math/gaussian.h"

namespace perdure::mapping {
namespace {

using Matrix46 = Eigen::Matrix<double, 4, 6>;
using Matrix10 = Eigen::Matrix<double, 10, 10>;

/// Jacobian of [δp, δyaw] with respect to the pose error [θ, p].
Matrix46 levelByPose(const Odometry& odometry) {
  Matrix46 B = Matrix46::Zero();
  B.topRightCorner<3, 3>().setIdentity();
  B.bottomLeftCorner<1, 3>() = odometry.up_W.transpose() * odometry.T_WB.R();
  return B;
}

/// Matrix that propagates an error [δp, δyaw] along the rigid motion from `before` to `now`.
Eigen::Matrix4d carried(const Odometry& before, const Odometry& now) {
  Eigen::Matrix4d S = Eigen::Matrix4d::Identity();
  S.topRightCorner<3, 1>() = now.up_W.cross(now.T_WB.p - before.T_WB.p);
  return S;
}

}  // namespace

void RelativeError::begin(const Odometry& odometry) {
  joint_.setZero();
  joint_.bottomRightCorner<6, 6>() = odometry.covariance.topLeftCorner<6, 6>();
}

void RelativeError::add(const Odometry& before, const Odometry& now, double metres) {
  const Eigen::Matrix4d S = carried(before, now);
  if (now.has_increment && now.increment_from == before.stamp.sequence) {
    const Matrix46 B = levelByPose(now);
    Matrix10 F = Matrix10::Zero();
    F.topLeftCorner<4, 4>() = S;
    F.topRightCorner<4, 6>() = B * now.transition - S * levelByPose(before);
    F.bottomRightCorner<6, 6>() = now.transition;
    Eigen::Matrix<double, 10, 6> G;
    G << B, Matrix6d::Identity();
    joint_ = (F * joint_ * F.transpose()).eval() + G * now.increment_covariance * G.transpose();
  } else {
    Eigen::Matrix4d P = S * covariance() * S.transpose();
    P.diagonal().head<3>().array() += metres * walk_.position * walk_.position;
    P(3, 3) += metres * walk_.yaw * walk_.yaw;
    begin(now);
    joint_.topLeftCorner<4, 4>() = P;
  }
  makeSymmetric(joint_);
}

}  // namespace perdure::mapping
