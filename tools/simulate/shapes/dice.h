// Seeded random choices for looks: the same seed gives the same shape on every machine.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <random>

namespace perdure::tools::shapes {

/// SplitMix64's finaliser: neighbouring seeds give unrelated numbers.
constexpr std::uint64_t mixBits(std::uint64_t x) {
  x += 0x9E3779B97F4A7C15ULL;
  x = (x ^ (x >> 30U)) * 0xBF58476D1CE4E5B9ULL;
  x = (x ^ (x >> 27U)) * 0x94D049BB133111EBULL;
  return x ^ (x >> 31U);
}

class Dice {
 public:
  explicit Dice(std::uint64_t seed) : engine_(mixBits(seed)) {}

  float uniform(float low, float high) {
    const auto unit = static_cast<double>(engine_() >> 11U) * 0x1.0p-53;
    return static_cast<float>(low + (high - low) * unit);
  }
  bool chance(float probability) { return uniform(0.0F, 1.0F) < probability; }
  /// Uniform in 0 … count − 1; count > 0.
  int below(int count) { return static_cast<int>(engine_() % static_cast<std::uint64_t>(count)); }
  template <typename T, std::size_t N>
  const T& pick(const std::array<T, N>& list) {
    return list[static_cast<std::size_t>(below(static_cast<int>(N)))];
  }
  std::uint64_t seed() { return engine_(); }
  /// Seed for the functions in noise.h.
  std::uint32_t noiseSeed() { return static_cast<std::uint32_t>(seed()); }

 private:
  std::mt19937_64 engine_;
};

}  // namespace perdure::tools::shapes
