#include "common/service/health.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>

#include "common/service/process.h"

namespace perdure::service {
namespace {

constexpr double kSilent = 0.75, kPeriods = 4.0;         // s; number of periods
constexpr double kLongestPeriod = 5.0, kWeight = 0.125;  // s; weight of the newest period

double secondsBetween(Input::Clock::time_point from, Input::Clock::time_point to) {
  return std::chrono::duration<double>(to - from).count();
}

}  // namespace

HealthMeter::HealthMeter(std::string process, InstanceId instance)
    : process_(std::move(process)), instance_(instance) {}

void HealthMeter::state(HealthState state, const std::string& message) {
  const std::lock_guard lock(mutex_);
  state_ = state;
  message_ = message;
}

Health HealthMeter::sample(Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  Health health;
  health.process = process_;
  health.instance = instance_;
  health.pid = static_cast<std::uint32_t>(getpid());
  health.state = state_;
  health.message = message_;
  health.frames_in = frames_in_;
  health.frames_out = frames_out_;
  health.dropped = dropped_;
  health.rate_hz = rateAt(now);
  health.cpu_s = processorSeconds();
  health.rss_bytes = residentBytes();
  return health;
}

/// Returns the rate of frames, in Hz, over the last five seconds.
double HealthMeter::rateAt(Clock::time_point now) {
  constexpr std::chrono::seconds kWindow{5};
  history_.emplace_back(now, frames_out_);
  while (history_.size() > 2 && now - history_.front().first > kWindow) history_.pop_front();
  const double seconds = std::chrono::duration<double>(now - history_.front().first).count();
  const auto frames = static_cast<double>(history_.back().second - history_.front().second);
  return seconds > 0 ? frames / seconds : 0.0;
}

void Input::heardAt(Clock::time_point now) {
  if (last_) {
    const double period = std::min(secondsBetween(*last_, now), kLongestPeriod);
    period_s_ = period_s_ ? *period_s_ + kWeight * (period - *period_s_) : period;
  }
  last_ = now;
}

bool Input::silent(Clock::time_point now) const {
  return period_s_ && secondsBetween(*last_, now) > std::max(kSilent, kPeriods * *period_s_);
}

std::string Input::sentence(Clock::time_point now) const {
  return fmt::format("no {} for {:.1f} s; {}", what_, last_ ? secondsBetween(*last_, now) : 0.0,
                     fix_);
}

}  // namespace perdure::service
