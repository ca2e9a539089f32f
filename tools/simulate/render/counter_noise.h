// Random numbers that depend only on a counter, so that a pixel of a frame has the same numbers in
// any drawing order and thread. The bits are mixed by SplitMix64 (Steele, Lea, Flood, OOPSLA 2014).
#pragma once

#include <cstdint>

#include "common/sim/dice.h"

namespace perdure::tools {

using sim::mixBits;
constexpr std::uint64_t mixBits(std::uint64_t a, std::uint64_t b) {
  return mixBits(mixBits(a) ^ b);
}

/// Returns a number in [0, 1).
constexpr float uniformOf(std::uint64_t bits) {
  return static_cast<float>(bits >> 40) * (1.0F / 16777216.0F);
}
/// Returns the scaled sum of four uniform numbers: mean 0, standard deviation 1, within ±3.5.
constexpr float normalOf(std::uint64_t bits) {
  const auto sum = static_cast<float>((bits & 0xffff) + (bits >> 16 & 0xffff) +
                                      (bits >> 32 & 0xffff) + (bits >> 48));
  return (sum - 131070.0F) * (1.7320508F / 65536.0F);
}

}  // namespace perdure::tools
