// Counts what never came. A reader that keeps the last few samples overwrites the oldest where its
// process is late, and DDS says so to nobody; the numbers of the stamps do.
#pragma once

#include <cstdint>

namespace perdure::bus {

/// One for each topic whose stamps number it: frames of one camera, odometry.
class Gaps {
 public:
  /// How many numbers lie between this message of `source` and the newest one before it. 0 for the
  /// first of a source, and for what comes twice or late.
  std::uint64_t before(std::uint64_t source, std::uint64_t sequence) {
    const bool follows = any_ && source == source_;
    if (follows && sequence <= newest_) return 0;
    const std::uint64_t missed = follows ? sequence - newest_ - 1 : 0;
    any_ = true, source_ = source, newest_ = sequence;
    return missed;
  }

 private:
  bool any_ = false;
  std::uint64_t source_ = 0, newest_ = 0;
};

}  // namespace perdure::bus
