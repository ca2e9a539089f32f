// The χ² distribution, for gates of filters and bounds of consistency tests.
#pragma once

namespace perdure {

/// Returns P(X <= x) for x >= 0 and `dof` >= 1 degrees of freedom.
double chi2Cdf(double x, int dof);
/// Returns the x with P(X <= x) = p, for p in (0, 1) and dof >= 1.
double chi2Quantile(double p, int dof);

}  // namespace perdure
