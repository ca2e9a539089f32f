// The gyroscope's bias from the coplanarity of epipolar normals (Kneip & Lynen, ICCV 2013; He et
// al., CVPR 2023). Derivation: tools/docs/maths/vio-starts.md.
#pragma once

#include <Eigen/Core>
#include <utility>
#include <vector>

namespace perdure::vio {

/// Matches between two times, as bearings of one camera, and the increment between them.
struct BearingPair {
  std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>> bearings;  ///< in C, unit
  Eigen::Matrix3d R_B0_B1;                                            ///< at bias zero
  Eigen::Matrix3d J_bias;  ///< right tangent of R_B0_B1 by the gyro bias
};
/// The gyro bias that makes each pair's epipolar normals most nearly coplanar.
Eigen::Vector3d gyroBiasFromPairs(const std::vector<BearingPair>& pairs,
                                  const Eigen::Matrix3d& R_BC);

}  // namespace perdure::vio
