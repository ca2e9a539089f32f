// Estimate of a landmark for publication, relative to the newest pose.
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "common/math/rigid_transform.h"
#include "common/types/odometry.h"

namespace perdure::vio {

struct LandmarkEstimate {
  std::uint64_t id = 0;
  Eigen::Vector3d p_W = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< conditional on the pose
  Eigen::Matrix<double, 3, 6> cross_pose = Eigen::Matrix<double, 3, 6>::Zero();
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
};

/// Cross-covariance with the pose [θ, p] of a point that moves rigidly with T_WB: δp_W = −R [p_B]×
/// θ + δp + R δp_B.
Eigen::Matrix<double, 3, 6> crossOfRigid(const Eigen::Vector3d& p_W, const RigidTransform& T_WB,
                                         const Matrix6d& pose_covariance);

}  // namespace perdure::vio
