// The health message of a process, published once a second, and the inputs that it depends on.
#pragma once

#include <atomic>
#include <chrono>
#include <deque>
#include <mutex>
#include <optional>
#include <string>

#include "common/types/health.h"

namespace perdure::service {

/// Counts may be changed from any thread.
class HealthMeter {
 public:
  HealthMeter(std::string process, InstanceId instance);

  void frameIn() { ++frames_in_; }
  void frameOut() { ++frames_out_; }
  void dropped(std::uint64_t n = 1) { dropped_ += n; }
  void setDropped(std::uint64_t total) { dropped_ = total; }
  /// Sets the state. `message`: one sentence on the fault and its fix, or on the cause of waiting.
  void state(HealthState state, const std::string& message = {});

  std::uint64_t framesIn() const { return frames_in_; }
  std::uint64_t framesOut() const { return frames_out_; }

  /// Returns the message for this second. The caller adds the reasons.
  Health sample(std::chrono::steady_clock::time_point now);

 private:
  using Clock = std::chrono::steady_clock;
  double rateAt(Clock::time_point now);

  const std::string process_;
  const InstanceId instance_;
  std::atomic<std::uint64_t> frames_in_{0}, frames_out_{0}, dropped_{0};
  std::mutex mutex_;
  HealthState state_ = HealthState::kStarting;
  std::string message_;
  std::deque<std::pair<Clock::time_point, std::uint64_t>> history_;
};

/// Detects that an input which a service needs has stopped. Use it in the loop's thread only.
class Input {
 public:
  using Clock = std::chrono::steady_clock;

  /// `what` names the input, for example "inertial samples". `fix` ends the message, for example
  /// "start capture".
  Input(std::string what, std::string fix) : what_(std::move(what)), fix_(std::move(fix)) {}

  void heard() { heardAt(Clock::now()); }
  void heardAt(Clock::time_point now);
  /// Returns true after 0.75 s without a message, or after four periods if these are longer. An
  /// input that has never arrived is not silent, because the service still waits for it.
  bool silent(Clock::time_point now) const;
  /// Returns the message about the silence, for example "no inertial samples for 1.2 s; <fix>".
  std::string sentence(Clock::time_point now) const;

 private:
  std::string what_, fix_;
  std::optional<Clock::time_point> last_;
  std::optional<double> period_s_;  ///< smoothed time between messages
};

}  // namespace perdure::service
