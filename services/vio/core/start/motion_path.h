// First estimates of the path of a window in motion, from epipolar planes with known rotations.
// Derivation: tools/docs/maths/vio-starts.md.
#pragma once

#include <Eigen/Core>
#include <utility>
#include <vector>

namespace perdure::vio {

/// A keyframe's inertial increments since the first one, and its camera, in B0.
struct PathFrame {
  double t = 0.0;             ///< s since the first keyframe
  Eigen::Vector3d lever, dp;  ///< m, from the body to the camera; position without v0 and gravity
};

/// Matched points of two keyframes as unit vectors in B0.
struct PathPair {
  std::size_t from = 0, to = 0;
  std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>> rays;
};

/// Velocity at the first keyframe, and gravity, in B0.
struct Path {
  Eigen::Vector3d v0, gravity;
  double cost = 0.0;  ///< twice the negative log posterior of the planes, robust
};

/// Returns the path with this initial speed (m/s) that fits the epipolar planes best. gravity is
/// its first estimate; sigma the standard deviation of a ray, in rad.
Path pathWithSpeed(double speed, const std::vector<PathFrame>& frames,
                   const std::vector<PathPair>& pairs, const Eigen::Vector3d& gravity,
                   double sigma);

/// Minimises ½ gᵀ M g − dᵀ g with |g| = length; M is symmetric, positive semidefinite.
Eigen::Vector3d solveOnSphere(const Eigen::Matrix3d& M, const Eigen::Vector3d& d, double length);

}  // namespace perdure::vio
