#include "common/service/process.h"

#include <sys/resource.h>
#include <systemd/sd-daemon.h>
#include <time.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>

namespace perdure::service {
namespace {

double seconds(const timeval& t) {
  return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
}

std::int64_t nowNs(clockid_t clock) {
  timespec t{};
  clock_gettime(clock, &t);
  return std::int64_t{t.tv_sec} * 1'000'000'000 + t.tv_nsec;
}

/// Returns the offset of the wall clock from the time since boot. `within_ns` receives the time
/// that the readings took.
std::int64_t wallOffsetNs(std::int64_t& within_ns) {
  const std::int64_t before = nowNs(CLOCK_BOOTTIME);
  const std::int64_t wall = nowNs(CLOCK_REALTIME);
  within_ns = nowNs(CLOCK_BOOTTIME) - before;
  return wall - before;
}

}  // namespace

double processorSeconds() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

std::uint64_t residentBytes() {
  std::ifstream statm("/proc/self/statm");
  std::uint64_t total = 0, resident = 0;
  statm >> total >> resident;
  return resident * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
}

ClockSteps::ClockSteps() {
  std::int64_t within = 0;
  offset_ns_ = wallOffsetNs(within);
}

void ClockSteps::look() {
  constexpr std::int64_t kStep = 100'000'000;  // ns; NTP slews at most 0.5 ms per second
  std::int64_t within = 0;
  const std::int64_t offset = wallOffsetNs(within);
  if (within > kStep / 2) return;  // the thread was interrupted between the readings
  if (std::abs(offset - offset_ns_) > kStep) {
    ++count_;
    last_ = std::chrono::steady_clock::now();
  }
  offset_ns_ = offset;
}

bool ClockSteps::recent() const {
  return count_ > 0 && std::chrono::steady_clock::now() - last_ < std::chrono::seconds(30);
}

void notifyReady() { sd_notify(0, "READY=1"); }
void notifyStopping() { sd_notify(0, "STOPPING=1"); }

Watchdog::Watchdog() {
  constexpr std::uint64_t kShare = 4;
  std::uint64_t watchdog_us = 0;
  if (sd_watchdog_enabled(0, &watchdog_us) > 0) {
    period_ = std::chrono::microseconds(watchdog_us / kShare);
  }
}

void Watchdog::feed(Clock::time_point now) {
  if (period_.count() == 0 || now < next_) return;
  next_ = now + period_;
  sd_notify(0, "WATCHDOG=1");
}

}  // namespace perdure::service
