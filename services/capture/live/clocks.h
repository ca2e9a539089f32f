// The clock of live stamps, and other clocks seen in it.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <optional>

#include "common/base/time.h"

namespace perdure::capture {

/// CLOCK_BOOTTIME, which nobody sets, laid on the wall clock as that was at the start: a wall clock
/// that is set later does not move the stamps.
class HostClock {
 public:
  HostClock();
  /// `boot_ns`: CLOCK_BOOTTIME.
  TimePoint at(std::int64_t boot_ns) const { return fromNanoseconds(boot_ns + to_wall_ns_); }
  static std::int64_t nowNs();
  /// From these to CLOCK_BOOTTIME, as they stand now.
  static std::int64_t monotonicToBootNs();
  static std::int64_t realtimeToBootNs();
  static std::int64_t monotonicNs();

 private:
  std::int64_t to_wall_ns_;
};

/// to − from, by the reading of both in which the least time went by: a thread may be interrupted
/// for milliseconds between two clocks.
std::int64_t clockDifference(const std::function<std::int64_t()>& from,
                             const std::function<std::int64_t()>& to);

/// Middle of the middle row's exposure. `start_ns`: when that of the first row began.
std::int64_t middleOfExposure(std::int64_t start_ns, std::int64_t exposure_us, double readout_s);

/// A camera's stamp as CLOCK_BOOTTIME. V4L2 stamps by CLOCK_MONOTONIC, where libcamera promises
/// CLOCK_BOOTTIME; they differ by the time that the machine was suspended. It is of the one that it
/// is nearer to, as both stand now.
std::int64_t cameraStampToBoot(std::int64_t stamp_ns, std::int64_t monotonic_ns,
                               std::int64_t boot_ns);

/// A clock elsewhere, of which only messages with its stamps are seen: they come late by a varying
/// time, and the least of the last seconds stands for none. What is left is that least delay, a
/// constant, which vio estimates as part of the camera's time offset.
class ClockMap {
 public:
  /// A message with the stamp `theirs_ns` was there at `ours_ns`.
  void observe(std::int64_t theirs_ns, std::int64_t ours_ns);
  /// Nothing in the first half second.
  std::optional<std::int64_t> toOurs(std::int64_t theirs_ns) const;
  /// Times that the clocks were found to have moved against each other by more than drift.
  std::uint64_t jumps() const { return jumps_; }

 private:
  struct Bucket {
    std::int64_t since_ns, least;
  };
  void begin(std::int64_t ours_ns);

  std::deque<Bucket> buckets_;  ///< least of ours − theirs, by second
  std::int64_t first_ns_ = 0, last_ns_ = 0;
  double offset_ = 0.0;
  bool settled_ = false;
  std::uint64_t jumps_ = 0;
};

}  // namespace perdure::capture
