#include "services/capture/live/clocks.h"

#include <time.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace perdure::capture {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;
constexpr std::int64_t kSettles_ns = kSecond / 2;
constexpr std::size_t kRemembered_s = 8;
constexpr double kDrift = 5e-4;          // drift between two quartz clocks, with a margin
constexpr double kJump_ns = 20'000'000;  // larger than any delay or drift

std::int64_t read(clockid_t clock) {
  timespec t{};
  clock_gettime(clock, &t);
  return std::int64_t{t.tv_sec} * kSecond + t.tv_nsec;
}

std::int64_t difference(clockid_t from, clockid_t to) {
  return clockDifference([from] { return read(from); }, [to] { return read(to); });
}

}  // namespace

std::int64_t clockDifference(const std::function<std::int64_t()>& from,
                             const std::function<std::int64_t()>& to) {
  constexpr int kTries = 10;
  constexpr std::int64_t kGood_ns = 2000;
  std::int64_t best = 0, least = std::numeric_limits<std::int64_t>::max();
  for (int i = 0; i < kTries && least > kGood_ns; ++i) {
    const std::int64_t before = from(), there = to(), took = from() - before;
    if (took >= least) continue;
    least = took;
    best = there - (before + took / 2);
  }
  return best;
}

HostClock::HostClock() : to_wall_ns_(difference(CLOCK_BOOTTIME, CLOCK_REALTIME)) {}

std::int64_t HostClock::nowNs() { return read(CLOCK_BOOTTIME); }

std::int64_t HostClock::monotonicToBootNs() { return difference(CLOCK_MONOTONIC, CLOCK_BOOTTIME); }

std::int64_t HostClock::realtimeToBootNs() { return difference(CLOCK_REALTIME, CLOCK_BOOTTIME); }

std::int64_t HostClock::monotonicNs() { return read(CLOCK_MONOTONIC); }

std::int64_t middleOfExposure(std::int64_t start_ns, std::int64_t exposure_us, double readout_s) {
  return start_ns + 500 * exposure_us + static_cast<std::int64_t>(0.5e9 * readout_s);
}

std::int64_t cameraStampToBoot(std::int64_t stamp_ns, std::int64_t monotonic_ns,
                               std::int64_t boot_ns) {
  const bool monotonic = std::abs(monotonic_ns - stamp_ns) <= std::abs(boot_ns - stamp_ns);
  return monotonic ? stamp_ns + (boot_ns - monotonic_ns) : stamp_ns;
}

void ClockMap::begin(std::int64_t ours_ns) {
  buckets_.clear();
  first_ns_ = ours_ns;
  settled_ = false;
}

void ClockMap::observe(std::int64_t theirs_ns, std::int64_t ours_ns) {
  const std::int64_t lateness = ours_ns - theirs_ns;
  if (buckets_.empty()) begin(ours_ns);
  const bool early = static_cast<double>(lateness) < offset_ - kJump_ns;
  if (settled_ && early) {  // the message arrives too early: the remote clock was set forward
    ++jumps_;
    begin(ours_ns);
  }
  if (buckets_.empty() || ours_ns - buckets_.back().since_ns >= kSecond) {
    buckets_.push_back({ours_ns, lateness});
    if (buckets_.size() > kRemembered_s) buckets_.pop_front();
  }
  buckets_.back().least = std::min(buckets_.back().least, lateness);
  const auto least =
      std::ranges::min_element(buckets_, [](auto& a, auto& b) { return a.least < b.least; })->least;
  const double target = static_cast<double>(least);
  if (!settled_) {
    offset_ = target;
    settled_ = ours_ns - first_ns_ >= kSettles_ns;
    // The delay is larger throughout the window: the remote clock was set back.
  } else if (target - offset_ > kJump_ns) {
    ++jumps_;
    offset_ = target;
  } else {
    const double most = kDrift * static_cast<double>(std::max<std::int64_t>(ours_ns - last_ns_, 0));
    offset_ += std::clamp(target - offset_, -most, most);
  }
  last_ns_ = ours_ns;
}

std::optional<std::int64_t> ClockMap::toOurs(std::int64_t theirs_ns) const {
  if (!settled_) return std::nullopt;
  return theirs_ns + std::llround(offset_);
}

}  // namespace perdure::capture
