// Fuses two estimates of one object if the correlation of their errors is unknown (Julier and
// Uhlmann 1997). Fuses probabilities likewise. An estimate fused with itself does not change.
// Derivation: tools/docs/maths/fusion.md.
#pragma once

#include "common/types/objects.h"

namespace perdure::mapping {

/// Estimate of [p, yaw, log size]; yaw is known modulo 180°.
struct CuboidGaussian {
  Vector7d mean = Vector7d::Zero();
  Matrix7d covariance = Matrix7d::Identity();
};
/// Returns `a` minus `b`, with yaw wrapped to (-90°, 90°].
Vector7d cuboidDifference(const Vector7d& a, const Vector7d& b);

/// Returns the weight of the information of `a`, [0, 1], that minimises the volume of the fused
/// covariance; .5 if both are equal. Both covariances must be positive definite.
double intersectionWeight(const Matrix7d& a, const Matrix7d& b);

/// Fuses `a` and `b` with the information w A⁻¹ + (1 - w) B⁻¹. If they contradict each other, the
/// result covers both, because their weighted mean would be wrong and overconfident. The yaw stays
/// within 90° of that of `a`.
CuboidGaussian intersect(const CuboidGaussian& a, const CuboidGaussian& b, double weight);

/// Returns the probability whose log-odds are the weighted mean of those of p and q: p^w q^(1-w),
/// normalised.
double pooled(double p, double q, double weight);

}  // namespace perdure::mapping
