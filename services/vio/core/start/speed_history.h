// The speed sensor's last samples, and its reading at any time.
#pragma once

#include <cstddef>
#include <deque>
#include <optional>
#include <vector>

#include "common/base/result.h"
#include "services/vio/core/estimator.h"
#include "services/vio/core/start/initialiser.h"

namespace perdure::vio {

class SpeedHistory {
 public:
  /// `max_age_s`: a sample is used for times no further away.
  explicit SpeedHistory(double max_age_s) : max_age_s_(max_age_s) {}

  /// Refuses "speed_not_finite" and "speed_out_of_order".
  Result<void> add(const TimedSpeed& sample);
  /// Between two samples that are at most two ages apart, else the nearest one with what the
  /// vehicle may have done since; nothing where that is too far away.
  std::optional<SpeedReading> at(TimePoint time) const;
  bool reaches(TimePoint time) const { return !samples_.empty() && samples_.back().time >= time; }
  std::vector<TimedSpeed> samples() const { return {samples_.begin(), samples_.end()}; }
  void clear() { samples_.clear(); }

 private:
  double max_age_s_;
  std::deque<TimedSpeed> samples_;
};

}  // namespace perdure::vio
