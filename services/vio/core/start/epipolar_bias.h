// Gyroscope bias from the coplanarity of epipolar normals (Kneip & Lynen, ICCV 2013; He et al.,
// CVPR 2023). Derivation: tools/docs/maths/vio-starts.md.
#pragma once

#include <Eigen/Core>
#include <utility>
#include <vector>

namespace perdure::vio {

/// Matches between two times, as bearings of one camera, and the rotation between them.
struct BearingPair {
  std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>> bearings;  ///< unit vectors in C
  Eigen::Matrix3d R_B0_B1;                                            ///< rotation with zero bias
  Eigen::Matrix3d J_bias;  ///< derivative of R_B0_B1 (right tangent) by the gyro bias
};
/// Gyro bias for which the epipolar normals of each pair are closest to coplanar.
Eigen::Vector3d gyroBiasFromPairs(const std::vector<BearingPair>& pairs,
                                  const Eigen::Matrix3d& R_BC);

}  // namespace perdure::vio
