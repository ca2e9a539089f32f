// What the operating system says of and hears from this process.
#pragma once

#include <chrono>
#include <cstdint>

namespace perdure::service {

double processorSeconds();      ///< of all threads since the start
std::uint64_t residentBytes();  ///< of memory

/// Sees when the wall clock was set: against the time since boot, by more than slewing could.
class ClockSteps {
 public:
  ClockSteps();
  /// To be asked about once a second.
  void look();
  std::uint64_t count() const { return count_; }
  bool recent() const;  ///< in the last 30 s

 private:
  std::int64_t offset_ns_ = 0;
  std::uint64_t count_ = 0;
  std::chrono::steady_clock::time_point last_{};
};

/// systemd's protocol, where NOTIFY_SOCKET is set; else nothing.
void notifyReady();
void notifyStopping();

/// systemd's watchdog, where it watches this process (WATCHDOG_USEC): what lives says so at least
/// once in its period, or is killed.
class Watchdog {
 public:
  using Clock = std::chrono::steady_clock;
  Watchdog();
  /// How often there is something to say; zero where nobody watches.
  std::chrono::microseconds period() const { return period_; }
  /// "I live": passed on four times in the watchdog's time at most.
  void feed(Clock::time_point now);

 private:
  std::chrono::microseconds period_{0};
  Clock::time_point next_{};
};

}  // namespace perdure::service
