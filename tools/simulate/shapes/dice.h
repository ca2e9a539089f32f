// Seeded random choices of appearance: the same seed gives the same shape on every machine.
#pragma once

#include <cstddef>
#include <cstdint>

#include "common/sim/dice.h"

namespace perdure::tools::shapes {

using sim::mixBits;

class Dice : public sim::Dice {
 public:
  using sim::Dice::Dice;

  float uniform(float low, float high) { return static_cast<float>(low + (high - low) * unit()); }
  bool chance(float probability) { return uniform(0.0F, 1.0F) < probability; }
  /// Uniform in 0 … count − 1; count > 0.
  int below(int count) {
    return static_cast<int>(sim::Dice::below(static_cast<std::size_t>(count)));
  }
  std::uint32_t noiseSeed() { return static_cast<std::uint32_t>(seed()); }
};

}  // namespace perdure::tools::shapes
