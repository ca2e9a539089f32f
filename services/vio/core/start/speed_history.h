// Recent samples of the speed sensor, and the speed at a given time.
#pragma once

#include <deque>
#include <optional>
#include <vector>

#include "common/base/result.h"
#include "services/vio/core/estimator.h"
#include "services/vio/core/start/initialiser.h"

namespace perdure::vio {

class SpeedHistory {
 public:
  /// `max_age_s`: largest distance in time at which a sample is used.
  explicit SpeedHistory(double max_age_s) : max_age_s_(max_age_s) {}

  /// Refuses "speed_not_finite" and "speed_out_of_order".
  Result<void> add(const SpeedSample& sample);
  /// Interpolates between samples at most two ages apart, or returns the nearest with a larger
  /// sigma. Empty if that is too old.
  std::optional<SpeedReading> at(TimePoint time) const;
  bool reaches(TimePoint time) const { return !samples_.empty() && samples_.back().time >= time; }
  std::vector<SpeedSample> samples() const { return {samples_.begin(), samples_.end()}; }
  void clear() { samples_.clear(); }

 private:
  double max_age_s_;
  std::deque<SpeedSample> samples_;
};

}  // namespace perdure::vio
