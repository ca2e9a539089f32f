#include "common/mapping/frames/level_pose.h"

#include "common/math/gaussian.h"
#include "common/math/so3.h"

namespace perdure::mapping {
namespace {

/// Shorter horizontal projections of a unit vector do not define a direction.
constexpr double kLeastHorizontal = 0.3;

Eigen::Vector3d horizontal(const Eigen::Vector3d& axis, const Eigen::Vector3d& up) {
  return axis - up.dot(axis) * up;
}

}  // namespace

Eigen::Matrix3d LevelPose::R() const { return rotationAboutZ(yaw); }

LevelPose LevelPose::operator*(const LevelPose& other) const {
  return {R() * other.p + p, wrapAngle(yaw + other.yaw)};
}

LevelPose LevelPose::inverse() const { return {-(R().transpose() * p), wrapAngle(-yaw)}; }

LevelError difference(const LevelPose& a, const LevelPose& b) {
  LevelError error;
  error << a.p - b.p, wrapAngle(a.yaw - b.yaw);
  return error;
}

LevelGaussian compose(const LevelGaussian& T_AB, const LevelGaussian& T_BC) {
  const Eigen::Matrix4d J = composedByFirst(T_AB.mean, T_BC.mean);
  const Eigen::Matrix4d K = composedBySecond(T_AB.mean);
  LevelGaussian T_AC{T_AB.mean * T_BC.mean,
                     J * T_AB.covariance * J.transpose() + K * T_BC.covariance * K.transpose()};
  makeSymmetric(T_AC.covariance);
  return T_AC;
}

LevelGaussian inverse(const LevelGaussian& T_AB) {
  const Eigen::Matrix4d J = invertedBy(T_AB.mean);
  LevelGaussian T_BA{T_AB.mean.inverse(), J * T_AB.covariance * J.transpose()};
  makeSymmetric(T_BA.covariance);
  return T_BA;
}

Eigen::Matrix4d composedByFirst(const LevelPose& T_AB, const LevelPose& T_BC) {
  const Eigen::Vector3d lever = T_AB.R() * T_BC.p;
  Eigen::Matrix4d J = Eigen::Matrix4d::Identity();
  J(0, 3) = -lever.y();
  J(1, 3) = lever.x();
  return J;
}

Eigen::Matrix4d composedBySecond(const LevelPose& T_AB) {
  Eigen::Matrix4d J = Eigen::Matrix4d::Identity();
  J.topLeftCorner<3, 3>() = T_AB.R();
  return J;
}

Eigen::Matrix4d invertedBy(const LevelPose& T_AB) {
  const LevelPose T_BA = T_AB.inverse();
  Eigen::Matrix4d J = Eigen::Matrix4d::Zero();
  J.topLeftCorner<3, 3>() = -T_AB.R().transpose();
  J(0, 3) = T_BA.p.y();
  J(1, 3) = -T_BA.p.x();
  J(3, 3) = -1.0;
  return J;
}

LevelPose levelOf(const RigidTransform& T_AB) { return {T_AB.p, yawOf(T_AB.R())}; }

RigidTransform levelled(const RigidTransform& T_AB, const Eigen::Vector3d& up_A) {
  const Eigen::Matrix3d R = T_AB.R();
  Eigen::Vector3d x = horizontal(R.col(0), up_A);
  if (x.norm() < kLeastHorizontal) x = horizontal(R.col(2), up_A);
  Eigen::Matrix3d level;
  level.col(0) = x.normalized();
  level.col(2) = up_A;
  level.col(1) = up_A.cross(level.col(0));
  return {level, T_AB.p};
}

}  // namespace perdure::mapping
