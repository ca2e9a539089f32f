// The valid range of times in messages and files.
#pragma once

#include <cstdint>

namespace perdure {

/// Nanoseconds within 146 years of the clock's zero: the difference of any two fits into 64 bits.
constexpr bool isTime(std::int64_t ns) {
  constexpr std::int64_t kLast = std::int64_t{1} << 62;
  return ns > -kLast && ns < kLast;
}

}  // namespace perdure
