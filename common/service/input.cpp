#include "common/service/input.h"

#include <fmt/format.h>

#include <algorithm>

namespace perdure::service {
namespace {

constexpr double kSilent = 0.75, kPeriods = 4.0;         // s; number of periods
constexpr double kLongestPeriod = 5.0, kWeight = 0.125;  // s; weight of the newest period

double secondsBetween(Input::Clock::time_point from, Input::Clock::time_point to) {
  return std::chrono::duration<double>(to - from).count();
}

}  // namespace

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
                     mend_);
}

}  // namespace perdure::service
