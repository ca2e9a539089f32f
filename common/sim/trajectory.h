// The pose of a body at any time, with exact derivatives. The position is a uniform quintic
// B-spline, the rotation a cumulative one of order 5. Source: Sommer et al., "Efficient Derivative
// Computation for Cumulative B-Splines on Lie Groups", CVPR 2020.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "common/math/rigid_transform.h"

namespace perdure::sim {

/// State of body B in the world W (z up) at one time. SI units.
struct MotionState {
  RigidTransform T_WB;
  Eigen::Vector3d velocity_W = Eigen::Vector3d::Zero();              ///< B's origin, m/s
  Eigen::Vector3d acceleration_W = Eigen::Vector3d::Zero();          ///< m/s²
  Eigen::Vector3d angular_velocity_B = Eigen::Vector3d::Zero();      ///< w_WB_B, rad/s
  Eigen::Vector3d angular_acceleration_B = Eigen::Vector3d::Zero();  ///< rad/s²
};

class Trajectory {
 public:
  /// Control poses every `interval_s` from `start_s`, at least one. The spline smooths them and
  /// does not pass through them. The first and the last control apply outside the range.
  /// Derivatives are continuous up to the rate of the acceleration (C⁴ position, C³ rotation).
  /// Adjacent controls must be less than half a turn apart. Two different controls at a very short
  /// interval form a step.
  Trajectory(double start_s, double interval_s, std::vector<RigidTransform> control_poses);
  /// A body at rest.
  explicit Trajectory(const RigidTransform& T_WB) : Trajectory(0.0, 1.0, {T_WB}) {}

  /// State at any finite time. The body is at rest until three intervals before the first control,
  /// and from three intervals after the last one.
  MotionState at(double t_s) const;
  RigidTransform poseAt(double t_s) const { return at(t_s).T_WB; }

 private:
  double start_s_, interval_s_;
  std::vector<RigidTransform> control_;
};

}  // namespace perdure::sim
