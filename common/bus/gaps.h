// Counts messages that a late reader's short history overwrote. DDS does not report this loss.
#pragma once

#include <cstdint>

namespace perdure::bus {

/// One counter per topic with numbered stamps: the frames of one camera, or odometry.
class Gaps {
 public:
  /// Missing sequence numbers between this message of `source` and the newest one before it.
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
