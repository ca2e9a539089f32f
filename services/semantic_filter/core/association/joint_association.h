// Which box belongs to which track, without committing: marginals of the one-to-one association
// by loopy belief propagation (Williams and Lau, "Approximate evaluation of marginal association
// probabilities with belief propagation", IEEE T-AES 2014), with existence (JIPDA).
// Replaces the paper's hand-made weights ("Data Association").
#pragma once

#include <Eigen/Core>

namespace perdure::semantic_filter {

struct Association {
  /// eta(j, z): message from all other tracks to track j: how free box z is for it, in (0, 1].
  Eigen::MatrixXd eta;
  /// explained(z): probability that some track made box z.
  Eigen::VectorXd explained;
  int iterations = 0;
};

/// `psi`(j, z) >= 0: weight of "object j made box z" against "object j made none, or is not there";
/// `fresh`(z) > 0: weight of "no object made z" (clutter counts 1, a new track adds its own).
Association associate(const Eigen::MatrixXd& psi, const Eigen::VectorXd& fresh);

}  // namespace perdure::semantic_filter
