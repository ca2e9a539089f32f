// Poses between frames whose z axes point against gravity. They have only position and yaw, because
// gravity determines roll and pitch of the body without drift.
#pragma once

#include <Eigen/Core>

#include "common/math/rigid_transform.h"

namespace perdure::mapping {

/// T_AB: x_A = R_z(yaw) x_B + p.
struct LevelPose {
  Eigen::Vector3d p = Eigen::Vector3d::Zero();  ///< m
  double yaw = 0.0;                             ///< rad, (-π, π]

  Eigen::Matrix3d R() const;
  Eigen::Vector3d operator*(const Eigen::Vector3d& x) const { return R() * x + p; }
  LevelPose operator*(const LevelPose& other) const;
  LevelPose inverse() const;
  RigidTransform rigid() const { return RigidTransform(R(), p); }
};

/// Errors are [δp, δyaw] with p = p̂ + δp (axes of A) and yaw = ŷ + δyaw; m and rad.
using LevelError = Eigen::Vector4d;
/// Returns the error of `a` relative to `b`.
LevelError difference(const LevelPose& a, const LevelPose& b);

/// T_AB with the covariance of its error.
struct LevelGaussian {
  LevelPose mean;
  Eigen::Matrix4d covariance = Eigen::Matrix4d::Zero();
};

/// Returns T_AB T_BC. The errors of the two factors must be independent.
LevelGaussian compose(const LevelGaussian& T_AB, const LevelGaussian& T_BC);
LevelGaussian inverse(const LevelGaussian& T_AB);

/// Jacobians of the error of T_AB T_BC: composedByFirst() with respect to the error of T_AB,
/// composedBySecond() to that of T_BC.
Eigen::Matrix4d composedByFirst(const LevelPose& T_AB, const LevelPose& T_BC);
Eigen::Matrix4d composedBySecond(const LevelPose& T_AB);
/// Jacobian of the error of T_AB⁻¹ with respect to the error of T_AB.
Eigen::Matrix4d invertedBy(const LevelPose& T_AB);

/// Returns position and yaw of a transform between two frames that are level, or nearly so.
LevelPose levelOf(const RigidTransform& T_AB);

/// Returns the pose in A of the frame at B's origin whose z axis is the unit vector `up_A`. Its x
/// axis is the horizontal projection of B's x axis. If that axis is within 17° of the vertical, B's
/// z axis, the viewing direction of a camera, is projected instead.
RigidTransform levelled(const RigidTransform& T_AB, const Eigen::Vector3d& up_A);

}  // namespace perdure::mapping
