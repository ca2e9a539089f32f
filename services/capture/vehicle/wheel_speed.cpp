#include "services/capture/vehicle/wheel_speed.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "common/base/errors.h"
#include "services/capture/vehicle/whole_number.h"

namespace perdure::capture {
namespace {

constexpr std::int64_t kReverseSilence_ns = 3'000'000'000;

[[noreturn]] void refuse(const char* key, const std::string& text, const std::string& why) {
  throw StartupError(ExitCode::kConfiguration, "{}: \"{}\" cannot be used: {}.", key, text, why);
}

CanSignal signalOf(const char* key, const std::string& text) {
  auto signal = parseCanSignal(text);
  if (!signal) refuse(key, text, signal.error().detail);
  return *signal;
}

bool isOf(const CanSignal& signal, std::uint32_t id, bool extended) {
  return signal.id == id && signal.extended == extended;
}

}  // namespace

Result<double> metresPerSecond(const std::string& unit) {
  static const std::map<std::string, double> kUnits = {
      {"m/s", 1.0},          {"mps", 1.0},          {"km/h", 1 / 3.6},       {"kmh", 1 / 3.6},
      {"kph", 1 / 3.6},      {"km/hr", 1 / 3.6},    {"mph", 0.44704},        {"mi/h", 0.44704},
      {"kn", 1852 / 3600.0}, {"kt", 1852 / 3600.0}, {"knots", 1852 / 3600.0}};
  std::string small = unit;
  std::ranges::transform(small, small.begin(), [](char c) {
    return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  });
  const auto it = kUnits.find(small);
  if (it != kUnits.end()) return it->second;
  return fail("speed_unit", fmt::format("its unit is \"{}\"; write \"m/s\", \"km/h\", \"mph\" or "
                                        "\"kn\" behind its range",
                                        unit));
}

WheelSettings wheelSettings(const std::vector<std::string>& signals, const std::string& reverse,
                            double sigma) {
  WheelSettings settings;
  settings.sigma = sigma;
  for (const auto& text : signals) {
    settings.wheels.push_back(signalOf("speed.can.signals", text));
    const auto unit = metresPerSecond(settings.wheels.back().unit);
    if (!unit) refuse("speed.can.signals", text, unit.error().detail);
  }
  if (settings.wheels.empty()) {
    throw StartupError(ExitCode::kConfiguration,
                       "speed.source: can needs speed.can.signals: one line of the vehicle's DBC "
                       "file for each wheel, or the one of its speed.");
  }
  if (reverse.empty()) return settings;
  const auto equals = reverse.rfind("==");
  if (equals == std::string::npos) {
    refuse("speed.can.reverse", reverse, "it does not end in == VALUE");
  }
  settings.reverse = signalOf("speed.can.reverse", reverse.substr(0, equals));
  const auto value = wholeNumber(std::string_view(reverse).substr(equals + 2));
  if (!value) refuse("speed.can.reverse", reverse, "what is behind == is no number");
  settings.reverse_value = *value;
  return settings;
}

WheelSpeed::WheelSpeed(WheelSettings settings) : settings_(std::move(settings)) {
  for (const CanSignal& signal : settings_.wheels) {
    wheels_.push_back({signal, metresPerSecond(signal.unit).value(), std::nullopt});
  }
}

std::optional<SpeedReading> WheelSpeed::frame(std::uint32_t id, bool extended,
                                              std::span<const std::uint8_t> data,
                                              std::int64_t time_ns) {
  hearReverse(id, extended, data, time_ns);
  std::optional<SpeedReading> early;
  const bool again = std::ranges::any_of(
      wheels_, [&](const Wheel& w) { return isOf(w.signal, id, extended) && w.speed; });
  if (again) {
    reasons_.add("speed_can_partial");
    early = reading();
  }
  bool taken = false;
  for (Wheel& wheel : wheels_) {
    if (isOf(wheel.signal, id, extended)) taken |= take(wheel, data, time_ns);
  }
  const bool all =
      std::ranges::all_of(wheels_, [](const Wheel& wheel) { return wheel.speed.has_value(); });
  if (!early && taken && all) early = reading();
  if (early && settings_.reverse && time_ns - reverse_ns_ > kReverseSilence_ns) {
    reasons_.add("speed_can_no_reverse");
    trouble_ = fmt::format(
        "CAN id {:#x} of speed.can.reverse says nothing: the speed is taken for "
        "forwards",
        settings_.reverse->id);
  }
  return early;
}

bool WheelSpeed::take(Wheel& wheel, std::span<const std::uint8_t> data, std::int64_t time_ns) {
  const auto value = valueOf(wheel.signal, data);
  if (!value) {
    reasons_.add(value.error());
    trouble_ = value.error().detail;
    return false;
  }
  wheel.speed = *value * wheel.to_mps;
  wheel.time_ns = time_ns;
  return true;
}

void WheelSpeed::hearReverse(std::uint32_t id, bool extended, std::span<const std::uint8_t> data,
                             std::int64_t time_ns) {
  if (!settings_.reverse || !isOf(*settings_.reverse, id, extended)) return;
  const auto raw = rawValueOf(*settings_.reverse, data);
  if (!raw) return reasons_.add(raw.error());
  reverse_ns_ = time_ns;
  const double value =
      static_cast<double>(*raw) * settings_.reverse->factor + settings_.reverse->offset;
  backwards_ =
      std::abs(value - settings_.reverse_value) < 0.5 * std::abs(settings_.reverse->factor);
}

std::optional<SpeedReading> WheelSpeed::reading() {
  double n = 0.0, sum = 0.0, squares = 0.0, variance = 0.0, age_ns = 0.0;
  std::int64_t newest_ns = 0;
  for (const Wheel& wheel : wheels_) {
    if (wheel.speed) newest_ns = std::max(newest_ns, wheel.time_ns);
  }
  for (Wheel& wheel : wheels_) {
    if (!wheel.speed) continue;
    const double step = wheel.signal.factor * wheel.to_mps;
    n += 1.0;
    sum += *wheel.speed;
    squares += *wheel.speed * *wheel.speed;
    variance += settings_.sigma * settings_.sigma + step * step / 12.0;
    age_ns += static_cast<double>(newest_ns - wheel.time_ns);
    wheel.speed.reset();
  }
  if (n == 0.0) return std::nullopt;
  trouble_.clear();
  const double mean = sum / n;
  const double apart = n > 1.0 ? std::max(0.0, squares - n * mean * mean) / (n - 1.0) : 0.0;
  return SpeedReading{newest_ns - std::llround(age_ns / n), backwards_ ? -mean : mean,
                      std::sqrt(variance / (n * n) + apart / n)};
}

}  // namespace perdure::capture
