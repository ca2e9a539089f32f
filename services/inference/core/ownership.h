// Which strength a result may be written with: a process that was taken for dead, or that comes
// late, must not take the topic back with old results (DESIGN: Liveliness).
#pragma once

#include <chrono>
#include <cstdint>

#include "common/base/time.h"

namespace perdure::inference {

/// Owner: `strength`; standby: one less; out of form: two less than the strength, so that a
/// healthy standby is heard. Form is lost by a missed lease (`losses` went up) or a result older
/// than the lease. It comes back after kGoodResults in a row that are neither, and not before
/// kLeases have passed: a process that wakes finds a heap of old frames that all look new to it.
class Ownership {
 public:
  static constexpr int kGoodResults = 10;
  static constexpr int kLeases = 3;
  using Time = std::chrono::steady_clock::time_point;

  Ownership(std::int64_t strength, bool standby, Duration lease)
      : full_(strength - (standby ? 1 : 0)), low_(strength - 2), lease_(lease) {}

  /// To be asked before each write. `age`: since this process got the frame; `losses`: how often
  /// its writer was taken for dead since the start.
  std::int64_t strengthFor(Time now, Duration age, std::uint64_t losses) {
    if (losses > losses_ || age > lease_) {
      losses_ = losses;
      lost_at_ = now;
      good_ = 0;
      in_form_ = false;
    } else if (!in_form_) {
      in_form_ = ++good_ >= kGoodResults && now - lost_at_ >= kLeases * lease_;
    }
    return in_form_ ? full_ : low_;
  }
  bool inForm() const { return in_form_; }

 private:
  std::int64_t full_, low_;
  Duration lease_;
  std::uint64_t losses_ = 0;
  bool in_form_ = true;
  Time lost_at_{};
  int good_ = 0;  ///< results in a row since then
};

}  // namespace perdure::inference
