// What a service needs to come for something to go out: it is noticed where it falls silent.
#pragma once

#include <chrono>
#include <optional>
#include <string>

namespace perdure::service {

/// Among Health's reasons while nothing but the silence of inputs makes it degraded.
inline constexpr char kInputSilent[] = "input_silent";

/// In the loop's thread only.
class Input {
 public:
  using Clock = std::chrono::steady_clock;

  /// "inertial samples", and what mends their silence: "mend the IMU, or start capture".
  Input(std::string what, std::string mend) : what_(std::move(what)), mend_(std::move(mend)) {}

  void heard() { heardAt(Clock::now()); }
  void heardAt(Clock::time_point now);
  /// Silent for three quarters of a second, or for four of its periods where that is longer. What
  /// has never come is not silent: the service says itself what it waits for.
  bool silent(Clock::time_point now) const;
  /// "no inertial samples for 1.2 s; mend the IMU, or start capture"
  std::string sentence(Clock::time_point now) const;

 private:
  std::string what_, mend_;
  std::optional<Clock::time_point> last_;
  std::optional<double> period_s_;  ///< smoothed
};

}  // namespace perdure::service
