#include "services/vio/core/start/speed_history.h"

#include <algorithm>
#include <cmath>

namespace perdure::vio {

constexpr std::size_t kSamples = 512;
constexpr double kSpeedChange = 2.0;  // m/s², deviation of the unknown acceleration

Result<void> SpeedHistory::add(const SpeedSample& sample) {
  if (!std::isfinite(sample.speed) || !(sample.sigma > 0) || !std::isfinite(sample.sigma)) {
    return fail("speed_not_finite");
  }
  if (!samples_.empty() && sample.time <= samples_.back().time) return fail("speed_out_of_order");
  samples_.push_back(sample);
  while (samples_.size() > kSamples) samples_.pop_front();
  return {};
}

std::optional<SpeedReading> SpeedHistory::at(TimePoint time) const {
  if (samples_.empty()) return std::nullopt;
  const auto after = std::find_if(samples_.begin(), samples_.end(),
                                  [&](const SpeedSample& s) { return s.time >= time; });
  if (after != samples_.end() && after != samples_.begin()) {
    const SpeedSample &a = *(after - 1), &b = *after;
    const double span = toSeconds(b.time - a.time);
    if (span <= 2.0 * max_age_s_) {
      const double s = toSeconds(time - a.time) / span;
      return SpeedReading{a.speed + s * (b.speed - a.speed), std::max(a.sigma, b.sigma)};
    }
  }
  const SpeedSample& nearest = after == samples_.end() ? samples_.back() : *after;
  const double age = std::abs(toSeconds(nearest.time - time));
  if (age > max_age_s_) return std::nullopt;
  return SpeedReading{nearest.speed, nearest.sigma + kSpeedChange * age};
}

}  // namespace perdure::vio
