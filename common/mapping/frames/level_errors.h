// Functions for the errors of level poses and of objects: propagation, rotation, and lower bounds.
#pragma once

#include <Eigen/Core>

#include "common/mapping/frames/level_pose.h"

namespace perdure::mapping {

/// Jacobian of an object's error in A with respect to the error of T_AB, which rotates about B's
/// origin. `arm_A` is the vector from that origin to the object.
Eigen::Matrix4d byFrame(const Eigen::Vector3d& arm_A);

/// Returns the covariance of [p, yaw] after a rotation of the axes by R.
Eigen::Matrix4d turnedBy(const Eigen::Matrix3d& R, const Eigen::Matrix4d& covariance);

/// The larger of the standard deviations of x and y, m.
double planeSigma(const Eigen::Matrix4d& covariance);

/// Adds the variances of an additional error with these standard deviations of position (m) and yaw
/// (rad).
void addFloor(Eigen::Matrix4d& covariance, double floor_m, double floor_rad);

}  // namespace perdure::mapping
