// Quantiles of samples.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

namespace perdure::tools {

/// Returns the sample at a share in [0, 1] of the sorted `values`, rounded down to a sample.
/// `values` must not be empty.
inline double sampleAt(std::vector<double> values, double share) {
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(share * (values.size() - 1.0));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

/// Returns the quantile q in [0, 1] by linear interpolation; 0 if `values` is empty.
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
