#include "common/mapping/fusion/covariance_intersection.h"

#include <algorithm>
#include <cmath>

#include "common/mapping/places/placed_object.h"
#include "common/math/gaussian.h"
#include "common/math/so3.h"

namespace perdure::mapping {
namespace {

constexpr int kYaw = 3;
/// χ² (7 degrees of freedom, .9999) above which two estimates contradict each other.
constexpr double kContradict = 29.9;

/// Generalised eigenvalues of B with respect to A.
Eigen::VectorXd relativeSpread(const Matrix7d& a, const Matrix7d& b) {
  const Cholesky<Matrix7d> L(a);
  const Matrix7d half = L.whiten(b);
  Matrix7d both = L.whiten(half.transpose().eval());
  makeSymmetric(both);
  return eigenvalues(both);
}

/// Derivative of log det (w A⁻¹ + (1 - w) B⁻¹) with respect to w. It decreases with w.
double slopeAt(double w, const Eigen::VectorXd& spread) {
  double slope = 0.0;
  for (const double s : spread) slope += (s - 1.0) / (w * s + 1.0 - w);
  return slope;
}

/// Mean and covariance of a mixture of both estimates.
CuboidGaussian coveringBoth(const CuboidGaussian& a, const CuboidGaussian& b, const Vector7d& d,
                            double w) {
  CuboidGaussian both;
  both.mean = a.mean + (1.0 - w) * d;
  both.covariance = w * a.covariance + (1.0 - w) * b.covariance + w * (1.0 - w) * d * d.transpose();
  return both;
}

}  // namespace

Vector7d cuboidDifference(const Vector7d& a, const Vector7d& b) {
  Vector7d d = a - b;
  d[kYaw] = wrapHalfTurn(d[kYaw]);
  return d;
}

double intersectionWeight(const Matrix7d& a, const Matrix7d& b) {
  constexpr double kSame = 1e-12;
  constexpr int kHalvings = 50;
  const Eigen::VectorXd spread = relativeSpread(a, b);
  if ((spread.array() - 1.0).abs().maxCoeff() < kSame) return 0.5;
  if (slopeAt(0.0, spread) <= 0.0) return 0.0;
  if (slopeAt(1.0, spread) >= 0.0) return 1.0;
  double low = 0.0, high = 1.0;
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = 0.5 * (low + high);
    (slopeAt(middle, spread) > 0.0 ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

CuboidGaussian intersect(const CuboidGaussian& a, const CuboidGaussian& b, double weight) {
  const Vector7d d = cuboidDifference(b.mean, a.mean);
  CuboidGaussian result;
  if (squaredMahalanobis(d, Matrix7d(a.covariance + b.covariance)) > kContradict) {
    result = coveringBoth(a, b, d, std::clamp(weight, 0.1, 0.9));
  } else {
    const Matrix7d J_b = (1.0 - weight) * inverseSymmetric(b.covariance);
    result.covariance = inverseSymmetric(Matrix7d(weight * inverseSymmetric(a.covariance) + J_b));
    result.mean = a.mean + result.covariance * (J_b * d);
  }
  result.mean[kYaw] = wrapAngle(result.mean[kYaw]);
  makeSymmetric(result.covariance);
  return result;
}

double pooled(double p, double q, double weight) {
  const double log_odds = weight * logOdds(p) + (1.0 - weight) * logOdds(q);
  return 1.0 / (1.0 + std::exp(-log_odds));
}

}  // namespace perdure::mapping
