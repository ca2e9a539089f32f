// Seeded random numbers that are the same on every machine and with every library.
#pragma once

#include <cmath>
#include <cstdint>
#include <initializer_list>
#include <random>
#include <string_view>

namespace perdure::sim {

/// SplitMix64's finaliser (Steele et al., 2014): adjacent seeds give unrelated numbers.
constexpr std::uint64_t mixBits(std::uint64_t x) {
  x += 0x9E3779B97F4A7C15ULL;
  x = (x ^ (x >> 30U)) * 0xBF58476D1CE4E5B9ULL;
  x = (x ^ (x >> 27U)) * 0x94D049BB133111EBULL;
  return x ^ (x >> 31U);
}

/// Combines a purpose and some numbers (scene's seed, frame, object id) into a separate seed.
constexpr std::uint64_t seedOf(std::string_view purpose,
                               std::initializer_list<std::uint64_t> numbers) {
  std::uint64_t seed = 0;
  for (const char c : purpose) seed = mixBits(seed ^ static_cast<std::uint8_t>(c));
  for (const std::uint64_t number : numbers) seed = mixBits(seed ^ number);
  return seed;
}

class Dice {
 public:
  explicit Dice(std::uint64_t seed) : engine_(mixBits(seed)) {}

  /// Uniform in [0, 1).
  double unit() { return static_cast<double>(engine_() >> 11U) * 0x1.0p-53; }
  double uniform(double low, double high) { return low + (high - low) * unit(); }
  bool chance(double probability) { return unit() < probability; }
  /// Uniform in 0 … count − 1; count > 0.
  std::size_t below(std::size_t count) { return static_cast<std::size_t>(engine_() % count); }
  std::uint64_t seed() { return engine_(); }
  /// Normal with mean 0 and standard deviation 1 (Box and Muller).
  double normal() {
    const double radius = std::sqrt(-2.0 * std::log(1.0 - unit()));
    return radius * std::cos(6.283185307179586 * unit());
  }
  const auto& pick(const auto& list) { return list[below(list.size())]; }

 private:
  std::mt19937_64 engine_;
};

}  // namespace perdure::sim
