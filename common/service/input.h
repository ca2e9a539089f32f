// An input that a service needs to produce output. The service detects when the input stops.
#pragma once

#include <chrono>
#include <optional>
#include <string>

namespace perdure::service {

/// Use it in the loop's thread only.
class Input {
 public:
  using Clock = std::chrono::steady_clock;

  /// `what`: "inertial samples"; `mend`: "mend the IMU, or start capture".
  Input(std::string what, std::string mend) : what_(std::move(what)), mend_(std::move(mend)) {}

  void heard() { heardAt(Clock::now()); }
  void heardAt(Clock::time_point now);
  /// True after three quarters of a second, or four periods, without a message. An input that has
  /// never arrived is not silent.
  bool silent(Clock::time_point now) const;
  /// Such as "no inertial samples for 1.2 s; mend the IMU, or start capture".
  std::string sentence(Clock::time_point now) const;

 private:
  std::string what_, mend_;
  std::optional<Clock::time_point> last_;
  std::optional<double> period_s_;  ///< smoothed
};

}  // namespace perdure::service
