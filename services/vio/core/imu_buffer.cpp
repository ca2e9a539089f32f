#include "services/vio/core/imu_buffer.h"

#include <algorithm>

#include "common/base/check.h"

namespace perdure::vio {
namespace {
bool earlier(const ImuReading& r, TimePoint t) { return r.time < t; }
}  // namespace

Result<void> ImuBuffer::add(const ImuReading& reading) {
  if (!reading.gyro.allFinite() || !reading.accel.allFinite()) return fail("imu_not_finite");
  if (!readings_.empty()) {
    if (reading.time == last()) return fail("imu_duplicate");
    if (reading.time < last()) return fail("imu_out_of_order");
  }
  readings_.push_back(reading);
  return {};
}

ImuReading ImuBuffer::at(TimePoint time) const {
  const auto after = std::lower_bound(readings_.begin(), readings_.end(), time, earlier);
  if (after == readings_.begin() || after == readings_.end()) {
    ImuReading held = after == readings_.end() ? readings_.back() : *after;
    held.time = time;
    return held;
  }
  const ImuReading &a = *(after - 1), &b = *after;
  const double s = toSeconds(time - a.time) / toSeconds(b.time - a.time);
  return {time, a.gyro + s * (b.gyro - a.gyro), a.accel + s * (b.accel - a.accel)};
}

std::vector<ImuReading> ImuBuffer::between(TimePoint from, TimePoint to) const {
  check(from < to, "an interval has a length");
  if (readings_.empty()) return {};
  std::vector<ImuReading> result{at(from)};
  for (auto it = std::lower_bound(readings_.begin(), readings_.end(), from, earlier);
       it != readings_.end() && it->time < to; ++it) {
    if (it->time > from) result.push_back(*it);
  }
  result.push_back(at(to));
  return result;
}

Duration ImuBuffer::longestGap(TimePoint from, TimePoint to) const {
  TimePoint previous = from;
  Duration longest{0};
  // The samples around the interval bound the gap, too: start from the one before it.
  auto it = std::lower_bound(readings_.begin(), readings_.end(), from, earlier);
  if (it != readings_.begin() && it != readings_.end()) previous = (it - 1)->time;
  for (; it != readings_.end(); ++it) {
    longest = std::max(longest, it->time - previous);
    previous = it->time;
    if (it->time >= to) return longest;
  }
  return std::max(longest, to - previous);
}

std::optional<Duration> ImuBuffer::period() const {
  constexpr std::size_t kSamples = 20;
  if (readings_.size() < 3) return std::nullopt;
  std::vector<Duration> steps;
  const std::size_t begin = readings_.size() > kSamples ? readings_.size() - kSamples : 1;
  for (std::size_t i = begin; i < readings_.size(); ++i) {
    steps.push_back(readings_[i].time - readings_[i - 1].time);
  }
  std::nth_element(steps.begin(), steps.begin() + static_cast<long>(steps.size() / 2), steps.end());
  return steps[steps.size() / 2];
}

void ImuBuffer::dropBefore(TimePoint time) {
  while (readings_.size() > 2 && readings_[1].time < time) readings_.pop_front();
}

}  // namespace perdure::vio
