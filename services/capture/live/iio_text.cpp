#include "services/capture/live/iio_text.h"

#include <algorithm>
#include <sstream>

namespace perdure::capture {

std::string trimmed(std::string_view text) {
  constexpr std::string_view kSpace(" \t\r\n\0", 5);
  const auto first = text.find_first_not_of(kSpace);
  if (first == std::string_view::npos) return {};
  return std::string(text.substr(first, text.find_last_not_of(kSpace) + 1 - first));
}

StampClock stampClockNamed(std::string_view text) {
  const std::string name = trimmed(text);
  if (name == "boottime") return StampClock::kBoot;
  if (name == "monotonic" || name == "monotonic_coarse") return StampClock::kMonotonic;
  if (name == "realtime" || name == "realtime_coarse") return StampClock::kRealtime;
  return StampClock::kElsewhere;
}

std::optional<Eigen::Matrix3d> parseMount(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](char c) { return c == ',' || c == ';'; }, ' ');
  std::istringstream in(text);
  Eigen::Matrix3d R;
  for (int i = 0; i < 9; ++i) {
    if (!(in >> R(i / 3, i % 3))) return std::nullopt;
  }
  return R;
}

}  // namespace perdure::capture
