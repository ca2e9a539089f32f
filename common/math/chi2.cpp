#include "common/math/chi2.h"

#include <cmath>

#include "common/base/check.h"

namespace perdure {
namespace {

// Regularised lower incomplete gamma function P(a, x): a series for x below a + 1, a continued
// fraction above (Abramowitz & Stegun 6.5.29 and 6.5.31).
double regularisedGamma(double a, double x) {
  if (x <= 0.0) return 0.0;
  const double scale = std::exp(-x + a * std::log(x) - std::lgamma(a));
  if (x < a + 1.0) {
    double term = 1.0 / a, sum = term;
    for (int n = 1; n < 2000 && term > sum * 1e-16; ++n) sum += term *= x / (a + n);
    return sum * scale;
  }
  double b = x + 1.0 - a, c = 1e300, d = 1.0 / b, h = d;
  for (int n = 1; n < 2000; ++n) {
    const double an = -n * (n - a);
    b += 2.0;
    d = 1.0 / (an * d + b);
    c = b + an / c;
    const double delta = d * c;
    h *= delta;
    if (std::abs(delta - 1.0) < 1e-15) break;
  }
  return 1.0 - scale * h;
}

}  // namespace

double chi2Cdf(double x, int dof) {
  check(dof >= 1, "χ² has at least one degree of freedom");
  return regularisedGamma(0.5 * dof, 0.5 * x);
}

double chi2Quantile(double p, int dof) {
  check(p > 0.0 && p < 1.0, "a quantile's probability lies in (0, 1)");
  double low = 0.0, high = dof + 10.0;
  while (chi2Cdf(high, dof) < p) high *= 2.0;
  for (int i = 0; i < 200 && high - low > 1e-12 * high; ++i) {
    const double middle = 0.5 * (low + high);
    (chi2Cdf(middle, dof) < p ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

}  // namespace perdure
