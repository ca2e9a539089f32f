#include "services/vio/core/propagation/imu_buffer.h"

#include <algorithm>

#include "common/base/check.h"

namespace perdure::vio {
namespace {

// If two successive samples are equal and above these values, they are at the sensor's limit.
constexpr double kLargeRate = 3.0, kLargeForce = 12.0;  // rad/s, m/s²

const auto kEarlier = [](const auto& item, TimePoint t) { return item.time < t; };

bool saturated(const Eigen::Vector3d& before, const Eigen::Vector3d& now, double large) {
  return ((before.array() == now.array()) && (now.array().abs() > large)).any();
}

}  // namespace

Result<void> ImuBuffer::add(const ImuReading& reading) {
  if (!reading.gyro.allFinite() || !reading.accel.allFinite()) return fail("imu_not_finite");
  bool gyro_saturated = false, accel_saturated = false;
  if (!raw_.empty()) {
    const ImuReading& before = raw_.back();
    if (reading.time == before.time) return fail("imu_duplicate");
    if (reading.time < before.time) return fail("imu_out_of_order");
    gyro_saturated = saturated(before.gyro, reading.gyro, kLargeRate);
    accel_saturated = saturated(before.accel, reading.accel, kLargeForce);
    const auto takeBack = [&](Values& values) {
      if (values.size() > 1 && values.back().time == before.time) values.pop_back();
    };
    if (gyro_saturated) takeBack(rates_);
    if (accel_saturated) takeBack(forces_);
  }
  raw_.push_back(reading);
  if (!gyro_saturated) rates_.push_back({reading.time, reading.gyro});
  if (!accel_saturated) forces_.push_back({reading.time, reading.accel});
  if (gyro_saturated) return fail("imu_gyro_saturated");
  if (accel_saturated) return fail("imu_accel_saturated");
  return {};
}

Eigen::Vector3d ImuBuffer::at(const Values& values, TimePoint time) {
  const auto after = std::lower_bound(values.begin(), values.end(), time, kEarlier);
  if (after == values.end()) return values.back().value;
  if (after == values.begin()) return after->value;
  const Value &a = *(after - 1), &b = *after;
  const double s = toSeconds(time - a.time) / toSeconds(b.time - a.time);
  return a.value + s * (b.value - a.value);
}

double ImuBuffer::spanAt(const Values& values, TimePoint time) {
  const auto after = std::lower_bound(values.begin(), values.end(), time, kEarlier);
  if (after == values.begin()) return toSeconds(after->time - time);
  return toSeconds((after == values.end() ? time : after->time) - (after - 1)->time);
}

ImuReading ImuBuffer::reading(TimePoint time) const {
  return {time, at(rates_, time), at(forces_, time), spanAt(rates_, time), spanAt(forces_, time)};
}

std::vector<ImuReading> ImuBuffer::between(TimePoint from, TimePoint to) const {
  std::vector<ImuReading> result;
  between(from, to, result);
  return result;
}

void ImuBuffer::between(TimePoint from, TimePoint to, std::vector<ImuReading>& readings) const {
  check(from < to, "an interval has a length");
  readings.clear();
  if (raw_.empty()) return;
  readings.push_back(reading(from));
  for (auto it = std::lower_bound(raw_.begin(), raw_.end(), from, kEarlier);
       it != raw_.end() && it->time < to; ++it) {
    if (it->time > from) readings.push_back(reading(it->time));
  }
  readings.push_back(reading(to));
}

Duration ImuBuffer::longestGap(TimePoint from, TimePoint to) const {
  TimePoint previous = from;
  Duration longest{0};
  // The gaps at the ends extend to the samples outside the interval.
  auto it = std::lower_bound(raw_.begin(), raw_.end(), from, kEarlier);
  if (it != raw_.begin() && it != raw_.end()) previous = (it - 1)->time;
  for (; it != raw_.end(); ++it) {
    longest = std::max(longest, it->time - previous);
    previous = it->time;
    if (it->time >= to) return longest;
  }
  return std::max(longest, to - previous);
}

std::optional<Duration> ImuBuffer::period() const {
  constexpr std::size_t kSamples = 20;
  if (raw_.size() < 3) return std::nullopt;
  std::vector<Duration> steps;
  const std::size_t begin = raw_.size() > kSamples ? raw_.size() - kSamples : 1;
  for (std::size_t i = begin; i < raw_.size(); ++i) {
    steps.push_back(raw_[i].time - raw_[i - 1].time);
  }
  std::nth_element(steps.begin(), steps.begin() + static_cast<long>(steps.size() / 2), steps.end());
  return steps[steps.size() / 2];
}

void ImuBuffer::dropBefore(TimePoint time) {
  const auto drop = [time](auto& items) {
    while (items.size() > 2 && items[1].time < time) items.pop_front();
  };
  drop(raw_);
  drop(rates_);
  drop(forces_);
}

}  // namespace perdure::vio
