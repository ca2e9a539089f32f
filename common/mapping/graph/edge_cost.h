// The cost terms of the pose graph: the residual of an edge between two anchors, and the robust
// cost of edges that may be wrong (Agarwal et al. 2013, dynamic covariance scaling). Derivation:
// tools/docs/maths/pose_graph.md.
#pragma once

#include <ceres/loss_function.h>
#include <ceres/sized_cost_function.h>

#include <Eigen/Core>

#include "common/mapping/frames/level_pose.h"

namespace perdure::mapping {

/// Returns the state [p, yaw] of a pose.
Eigen::Vector4d stateOf(const LevelPose& pose);

/// Whitened [R_aᵀ (p_b − p_a) − t, yaw_b − yaw_a − ψ] of a measured T_ab = (t, ψ). The parameters
/// are the states of a and b in M.
class EdgeCost final : public ceres::SizedCostFunction<4, 4, 4> {
 public:
  explicit EdgeCost(const LevelGaussian& T_ab);
  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override;

 private:
  LevelPose T_ab_;
  Eigen::Matrix4d whitening_;  ///< L⁻¹ of the covariance L Lᵀ
};

/// Robust cost: χ² up to `kernel`, and less than three times the kernel for any larger χ².
class ScalingLoss final : public ceres::LossFunction {
 public:
  explicit ScalingLoss(double kernel) : kernel_(kernel) {}
  void Evaluate(double chi2, double rho[3]) const override;
  /// Factor of the edge's information, (0, 1]: the square of the switch variable.
  double weight(double chi2) const;

 private:
  double kernel_;
};

}  // namespace perdure::mapping
