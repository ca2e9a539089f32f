// Joint association: marginals of the one-to-one association of boxes and tracks by loopy belief
// propagation (Williams, Lau, IEEE T-AES 2014), with existence (Musicki, Evans, IEEE T-AES 2004).
// It replaces the weights that the paper sets by hand ("Data Association"). Derivation:
// tools/docs/maths/joint_association.md.
#pragma once

#include <Eigen/Core>

namespace perdure::semantic_filter {

struct Association {
  /// eta(j, z): message from all other tracks to track j, in (0, 1]. The better another track or a
  /// new one explains box z, the smaller it is.
  Eigen::MatrixXd eta;
  /// explained(z): probability that some track made box z.
  Eigen::VectorXd explained;
  int iterations = 0;
};

/// `psi`(j, z) >= 0: weight of "track j made box z" against "track j made none, or does not exist".
/// `fresh`(z) > 0: weight of "no track made box z"; 1 for clutter, plus the weight of a new track.
Association associate(const Eigen::MatrixXd& psi, const Eigen::VectorXd& fresh);

}  // namespace perdure::semantic_filter
