// The χ² distribution, for gates of filters and bounds of consistency tests.
#pragma once

namespace perdure {

/// P(X <= x) for `dof` >= 1 degrees of freedom, x >= 0.
double chi2Cdf(double x, int dof);
/// The x with P(X <= x) = p; p in (0, 1), dof >= 1.
double chi2Quantile(double p, int dof);

}  // namespace perdure
