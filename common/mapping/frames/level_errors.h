// Errors of level poses and of objects: how they turn, and what they say at least.
#pragma once

#include <Eigen/Core>

#include "common/mapping/frames/level_pose.h"

namespace perdure::mapping {

/// d(error of an object of B in A) by d(error of T_AB): it turns about B's origin. `arm_A` from
/// there to the object.
Eigen::Matrix4d byFrame(const Eigen::Vector3d& arm_A);

/// A covariance of [p, yaw] in axes that R turns it into.
Eigen::Matrix4d turnedBy(const Eigen::Matrix3d& R, const Eigen::Matrix4d& covariance);

/// The larger deviation of x and y, m.
double planeSigma(const Eigen::Matrix4d& covariance);

/// Adds the least deviations of a place (m) and of a yaw (rad).
void addFloor(Eigen::Matrix4d& covariance, double floor_m, double floor_rad);

}  // namespace perdure::mapping
