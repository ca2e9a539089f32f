// Damages a seed; a given random seed gives the same bytes on every machine.
#pragma once

#include <cstdint>
#include <random>

#include "tests/fuzz/target.h"

namespace perdure::fuzz {

class Mutator {
 public:
  explicit Mutator(std::uint64_t seed) : random_(seed) {}

  /// Applies one to four changes to `seed`; parts may come from `other`.
  Bytes damaged(const Bytes& seed, const Bytes& other);

 private:
  std::size_t below(std::size_t n) { return n == 0 ? 0 : static_cast<std::size_t>(random_() % n); }
  void change(Bytes& bytes, const Bytes& other);
  void putNumber(Bytes& bytes);
  void putWord(Bytes& bytes);
  void moveLine(Bytes& bytes, bool copy);

  std::mt19937_64 random_;
};

}  // namespace perdure::fuzz
