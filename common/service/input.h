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

  /// The name of the input, "inertial samples", and the fix for its silence: "mend the IMU, or
  /// start capture".
  Input(std::string what, std::string mend) : what_(std::move(what)), mend_(std::move(mend)) {}

  void heard() { heardAt(Clock::now()); }
  void heardAt(Clock::time_point now);
  /// Returns true after three quarters of a second without a message, or after four periods if that
  /// is longer. An input that has never arrived is not silent; the service then reports what it is
  /// waiting for.
  bool silent(Clock::time_point now) const;
  /// The message about the silence, such as "no inertial samples for 1.2 s; mend the IMU, or start
  /// capture".
  std::string sentence(Clock::time_point now) const;

 private:
  std::string what_, mend_;
  std::optional<Clock::time_point> last_;
  std::optional<double> period_s_;  ///< smoothed
};

}  // namespace perdure::service
