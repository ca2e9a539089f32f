// Fuses two estimates of one object whose errors have an unknown correlation (Julier and Uhlmann
// 1997), and does the same for probabilities. The fusion of an estimate with itself leaves it
// unchanged. Derivation: tools/docs/maths/fusion.md.
#pragma once

#include "common/types/objects.h"

namespace perdure::mapping {

/// Estimate of [p, yaw, log size]; yaw is known modulo 180°.
struct CuboidGaussian {
  Vector7d mean = Vector7d::Zero();
  Matrix7d covariance = Matrix7d::Identity();
};
/// `a` minus `b`, yaw in (-90°, 90°].
Vector7d cuboidDifference(const Vector7d& a, const Vector7d& b);

/// Weight of the information of `a`, [0, 1]; `b` has the remaining weight. It minimises the volume
/// of the result. It is .5 if both are equal. Both must be positive definite.
double intersectionWeight(const Matrix7d& a, const Matrix7d& b);

/// Fuses with the information w A⁻¹ + (1 - w) B⁻¹. If the two contradict each other, the result
/// covers both, because their mean would be overconfident and wrong. Yaw stays near that of `a`.
CuboidGaussian intersect(const CuboidGaussian& a, const CuboidGaussian& b, double weight);

/// p^w q^(1-w), normalised: the weighted mean of the log-odds.
double pooled(double p, double q, double weight);

}  // namespace perdure::mapping
