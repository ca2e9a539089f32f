#include "services/semantic_filter/core/planning/entropy.h"

#include <cmath>

namespace perdure::semantic_filter {
namespace {

/// Returns -p log2 p, which is 0 at p = 0.
double term(double p) { return p > 0.0 ? -p * std::log2(p) : 0.0; }

}  // namespace

double entropyOf(double p) { return term(p) + term(1.0 - p); }

double existenceFall(double r, double missed) {
  const double no_detection = 1.0 - r + r * missed;
  if (no_detection <= 0.0) return entropyOf(r);
  return entropyOf(r) - no_detection * entropyOf(r * missed / no_detection);
}

double classFall(const std::vector<double>& pmf, double nats) {
  // P(two classes are told apart) = (1 + resolved) / 2, if log-likelihood ratios are Gaussian.
  const double resolved = std::erf(0.5 * std::sqrt(nats));
  double fall = 0.0;
  for (const double p : pmf) {
    if (p <= 0.0) continue;
    const double same = resolved + (1.0 - resolved) * p;
    fall += p * same * std::log2(same / p) - (1.0 - p) * p * term(1.0 - resolved);
  }
  return fall;
}

}  // namespace perdure::semantic_filter
