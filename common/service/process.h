// Interface to the operating system: CPU time, memory, steps of the clock, and systemd.
#pragma once

#include <chrono>
#include <cstdint>

namespace perdure::service {

double processorSeconds();      ///< CPU time of all threads since the start
std::uint64_t residentBytes();  ///< resident memory

/// Detects steps of the wall clock. A step is a change relative to the time since boot that is
/// larger than slewing can cause.
class ClockSteps {
 public:
  ClockSteps();
  /// Checks for a step. Call it once a second.
  void look();
  std::uint64_t count() const { return count_; }
  bool recent() const;  ///< true if there was a step in the last 30 s

 private:
  std::int64_t offset_ns_ = 0;
  std::uint64_t count_ = 0;
  std::chrono::steady_clock::time_point last_{};
};

/// Sends systemd's notifications if NOTIFY_SOCKET is set; otherwise does nothing.
void notifyReady();
void notifyStopping();

/// Client of systemd's watchdog; has no effect unless WATCHDOG_USEC enables the watchdog. systemd
/// kills a process that sends no message within the watchdog's period.
class Watchdog {
 public:
  using Clock = std::chrono::steady_clock;
  Watchdog();
  /// Returns the interval of messages; zero without a watchdog.
  std::chrono::microseconds period() const { return period_; }
  /// Sends a keep-alive message, at most four times per watchdog period.
  void feed(Clock::time_point now);

 private:
  std::chrono::microseconds period_{0};
  Clock::time_point next_{};
};

}  // namespace perdure::service
