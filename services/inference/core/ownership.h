// Which strength a result may be written with: a process that was taken for dead, or that comes
// late, must not take the topic back with old results (DESIGN: Liveliness).
#pragma once

#include <cstdint>

#include "common/base/time.h"

namespace perdure::inference {

/// Owner: `strength`; standby: one less; out of form: two less than the strength, so that a
/// healthy standby is heard. Form is lost by a missed lease (`losses` went up) or a result older
/// than the lease, and comes back after kGoodResults in a row that are neither.
class Ownership {
 public:
  static constexpr int kGoodResults = 10;

  Ownership(std::int64_t strength, bool standby, Duration lease)
      : full_(strength - (standby ? 1 : 0)), low_(strength - 2), lease_(lease) {}

  /// To be asked before each write. `age`: since this process got the frame; `losses`: how often
  /// its writer was taken for dead since the start.
  std::int64_t strengthFor(Duration age, std::uint64_t losses) {
    if (losses > losses_ || age > lease_) {
      losses_ = losses;
      missing_ = kGoodResults;
    } else if (missing_ > 0) {
      --missing_;
    }
    return inForm() ? full_ : low_;
  }
  bool inForm() const { return missing_ == 0; }

 private:
  std::int64_t full_, low_;
  Duration lease_;
  std::uint64_t losses_ = 0;
  int missing_ = 0;  ///< good results until the form is back
};

}  // namespace perdure::inference
