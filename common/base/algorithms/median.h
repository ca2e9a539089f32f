// The median of values in any order.
#pragma once

#include <algorithm>
#include <cstddef>

namespace perdure {

/// Returns the middle value, or the larger one of the two middle values. Returns 0 if there are no
/// values.
template <class Values>
typename Values::value_type medianOf(Values values) {
  if (values.empty()) return {};
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace perdure
