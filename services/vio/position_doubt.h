// Detects that the position has become uncertain: its standard deviation has grown by more than a
// limit over the last ten seconds. The error of a long and healthy drive grows more slowly.
#pragma once

#include <deque>
#include <utility>

#include "common/base/time.h"
#include "common/types/odometry.h"

namespace perdure::vio {

class PositionDoubt {
 public:
  explicit PositionDoubt(double limit_m) : limit_m_(limit_m) {}

  /// Adds the next pose of the same world; true if its position is uncertain.
  bool add(TimePoint now, const Matrix9d& covariance) {
    const double variance = covariance.block<3, 3>(3, 3).trace();
    while (!before_.empty() && before_.front().first < now - std::chrono::seconds(10)) {
      before_.pop_front();
    }
    before_.emplace_back(now, variance);
    // Errors of separate distances add as variances.
    return uncertain_ = variance - before_.front().second > limit_m_ * limit_m_;
  }
  bool uncertain() const { return uncertain_; }
  void clear() {
    before_.clear();
    uncertain_ = false;
  }

 private:
  double limit_m_;
  std::deque<std::pair<TimePoint, double>> before_;  ///< variances of the position
  bool uncertain_ = false;
};

}  // namespace perdure::vio
