// Two estimates of one thing whose errors are correlated in an unknown way (Julier and Uhlmann
// 1997), and the same for probabilities. What is fused with itself stays as it is.
// Derivation: tools/docs/maths/fusion.md.
#pragma once

#include "common/types/objects.h"

namespace perdure::mapping {

/// Of [p, yaw, log size]; yaw is known modulo 180°.
struct CuboidGaussian {
  Vector7d mean = Vector7d::Zero();
  Matrix7d covariance = Matrix7d::Identity();
};
/// `a` minus `b`, yaw in (-90°, 90°].
Vector7d cuboidDifference(const Vector7d& a, const Vector7d& b);

/// By which the information of `a` counts, that of `b` by the rest, [0, 1]: such that the volume of
/// the result is least. .5 where both are the same. Both must be positive definite.
double intersectionWeight(const Matrix7d& a, const Matrix7d& b);

/// With information w A⁻¹ + (1 - w) B⁻¹. Where the two contradict each other the result covers
/// both: their mean would be surer than either, and wrong. Yaw stays on the side of `a`.
CuboidGaussian intersect(const CuboidGaussian& a, const CuboidGaussian& b, double weight);

/// p^w q^(1-w), normalised: the weighted mean of the log-odds.
double pooled(double p, double q, double weight);

}  // namespace perdure::mapping
