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
  /// `max_age_s`: a sample is used up to this time before and after its own.
  explicit SpeedHistory(double max_age_s) : max_age_s_(max_age_s) {}

  /// Adds a sample. Refuses it with "speed_not_finite" or "speed_out_of_order".
  Result<void> add(const SpeedSample& sample);
  /// Interpolates between samples that are at most 2 `max_age_s` apart; otherwise returns the
  /// nearest sample with a larger sigma. Returns nothing if that sample is farther than
  /// `max_age_s`.
  std::optional<SpeedReading> at(TimePoint time) const;
  bool reaches(TimePoint time) const { return !samples_.empty() && samples_.back().time >= time; }
  std::vector<SpeedSample> samples() const { return {samples_.begin(), samples_.end()}; }
  void clear() { samples_.clear(); }

 private:
  double max_age_s_;
  std::deque<SpeedSample> samples_;
};

}  // namespace perdure::vio
