// Checks whether the speed was refused for most of the last second or more. Health then reports it.
#pragma once

#include <algorithm>
#include <optional>

#include "common/base/time.h"

namespace perdure::vio {

class SpeedDoubt {
 public:
  /// Adds the next image. refused: whether the gate refused the speed; empty without a speed.
  void add(TimePoint now, std::optional<bool> refused) {
    const double passed_s = last_ ? toSeconds(now - *last_) : 0.0;
    last_ = now;
    const double forgets = std::clamp(passed_s / kMemory_s, 0.0, 1.0);
    share_ += forgets * ((refused.value_or(false) ? 1.0 : 0.0) - share_);
  }
  /// The problem as a sentence; empty if there is no problem.
  const char* sentence() const {
    if (share_ < kMost) return "";
    return "the speed contradicts camera and IMU and is refused: see its unit (m/s), its sign "
           "(forwards is positive), its scale and its stamps; or the wheels slip";
  }

 private:
  static constexpr double kMemory_s = 1.0, kMost = 0.6;  // exceeded after 0.9 s of refusals alone
  double share_ = 0.0;
  std::optional<TimePoint> last_;
};

}  // namespace perdure::vio
