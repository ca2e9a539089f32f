// The sensor clock: a typed time point in nanoseconds. Filters never read a clock.
#pragma once

#include <chrono>
#include <cstdint>

namespace perdure {

using Duration = std::chrono::nanoseconds;

/// The clock of the sensors or of a recording. It has no now(), because time arrives in messages
/// only.
struct SensorClock {
  using rep = std::int64_t;
  using period = std::nano;
  using duration = Duration;
  using time_point = std::chrono::time_point<SensorClock, Duration>;
  static constexpr bool is_steady = false;
};
using TimePoint = SensorClock::time_point;

constexpr TimePoint fromNanoseconds(std::int64_t ns) { return TimePoint(Duration(ns)); }
constexpr std::int64_t toNanoseconds(TimePoint t) { return t.time_since_epoch().count(); }
constexpr double toSeconds(Duration d) { return static_cast<double>(d.count()) * 1e-9; }
constexpr double toSeconds(TimePoint t) { return toSeconds(t.time_since_epoch()); }
/// Converts seconds, |s| < 9e9, to a duration, rounded to the nearest nanosecond.
constexpr Duration durationFromSeconds(double s) {
  return Duration(static_cast<std::int64_t>(s * 1e9 + (s < 0 ? -0.5 : 0.5)));
}

/// Returns true if the time is within 146 years of the clock's zero. The difference of two such
/// times fits into 64 bits.
constexpr bool isTime(std::int64_t ns) {
  constexpr std::int64_t kLast = std::int64_t{1} << 62;
  return ns > -kLast && ns < kLast;
}

}  // namespace perdure
