// The number of different bits of two binary descriptors.
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <cstring>

namespace perdure {

/// Returns the number of different bits of two 256-bit descriptors, 0 to 256.
inline int hammingDistance(const std::array<std::uint8_t, 32>& a,
                           const std::array<std::uint8_t, 32>& b) {
  std::array<std::uint64_t, 4> x, y;
  std::memcpy(x.data(), a.data(), sizeof(x));
  std::memcpy(y.data(), b.data(), sizeof(y));
  int bits = 0;
  for (std::size_t k = 0; k < x.size(); ++k) bits += std::popcount(x[k] ^ y[k]);
  return bits;
}

}  // namespace perdure
