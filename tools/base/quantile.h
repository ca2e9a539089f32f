// Quantiles of samples.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

namespace perdure::tools {

/// The quantile of `values`, which must not be empty; between two samples, the lower one.
inline double sampleAt(std::vector<double> values, double share) {
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(share * (values.size() - 1.0));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

/// Quantile of a sample by linear interpolation; q in [0, 1]; 0 for an empty sample.
inline double quantile(std::vector<double> values, double q) {
  if (values.empty()) return 0.0;
  std::sort(values.begin(), values.end());
  const double at = q * static_cast<double>(values.size() - 1);
  const auto low = static_cast<std::size_t>(std::floor(at));
  const std::size_t high = std::min(low + 1, values.size() - 1);
  const double part = at - static_cast<double>(low);
  return (1.0 - part) * values[low] + part * values[high];
}

}  // namespace perdure::tools
