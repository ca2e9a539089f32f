// The clock of live stamps, and the conversion from other clocks.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <optional>

#include "common/base/time.h"

namespace perdure::capture {

/// CLOCK_BOOTTIME, which cannot be set, plus the offset of the wall clock at the start. Setting the
/// wall clock later does not change the stamps.
class HostClock {
 public:
  HostClock();
  /// Returns the stamp for `boot_ns`, a time of CLOCK_BOOTTIME.
  TimePoint at(std::int64_t boot_ns) const { return fromNanoseconds(boot_ns + to_wall_ns_); }
  static std::int64_t nowNs();
  /// Return the current offsets from CLOCK_MONOTONIC and the wall clock to CLOCK_BOOTTIME.
  static std::int64_t monotonicToBootNs();
  static std::int64_t realtimeToBootNs();
  static std::int64_t monotonicNs();

 private:
  std::int64_t to_wall_ns_;
};

/// Returns the difference to − from. Of several pairs of readings it uses the one that took the
/// least time, because a thread may be interrupted for milliseconds between two readings.
std::int64_t clockDifference(const std::function<std::int64_t()>& from,
                             const std::function<std::int64_t()>& to);

/// Returns the time of the middle of the middle row's exposure. `start_ns`: start of the first
/// row's exposure.
std::int64_t middleOfExposure(std::int64_t start_ns, std::int64_t exposure_us, double readout_s);

/// Converts a camera's stamp to CLOCK_BOOTTIME. V4L2 stamps with CLOCK_MONOTONIC, although
/// libcamera specifies CLOCK_BOOTTIME. The two differ by the time that the machine was suspended.
/// Assumes the clock whose current reading is nearer to the stamp.
std::int64_t cameraStampToBoot(std::int64_t stamp_ns, std::int64_t monotonic_ns,
                               std::int64_t boot_ns);

/// Converts times of a remote clock, which is known only from stamped messages. Messages have a
/// varying delay; the least delay of the last seconds is taken as zero. The remaining constant
/// delay is part of the camera's time offset, which vio estimates.
class ClockMap {
 public:
  /// Adds a message with stamp `theirs_ns` that arrived at `ours_ns`.
  void observe(std::int64_t theirs_ns, std::int64_t ours_ns);
  /// Converts a remote time. Returns nothing in the first half second.
  std::optional<std::int64_t> toOurs(std::int64_t theirs_ns) const;
  std::uint64_t jumps() const { return jumps_; }

 private:
  struct Bucket {
    std::int64_t since_ns, least;
  };
  void begin(std::int64_t ours_ns);

  std::deque<Bucket> buckets_;  ///< smallest ours − theirs of each second
  std::int64_t first_ns_ = 0, last_ns_ = 0;
  double offset_ = 0.0;
  bool settled_ = false;
  std::uint64_t jumps_ = 0;
};

}  // namespace perdure::capture
