// The median of values in any order.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace perdure {

/// The middle value, or the upper one of the two in the middle. Returns 0 if there are no values.
template <class T>
T medianOf(std::vector<T> values) {
  if (values.empty()) return T{};
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace perdure
