#include "common/replay/files/stamps.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "common/replay/files/text_file.h"

namespace perdure::replay {
namespace {

/// A decimal number: its digits, and the number of digits before the point.
struct Decimal {
  std::string digits;
  std::int64_t point = 0;
};

std::optional<Decimal> decimalOf(std::string_view text) {
  if (text.starts_with('+')) text.remove_prefix(1);
  Decimal decimal;
  std::int64_t exponent = 0;
  if (const auto e = text.find_first_of("eE"); e != text.npos) {
    const auto value = parseInteger(text.substr(e + 1));
    if (!value || std::abs(*value) > 64) return std::nullopt;
    exponent = *value;
    text = text.substr(0, e);
  }
  const auto dot = text.find('.');
  decimal.digits = text.substr(0, dot);
  decimal.point = static_cast<std::int64_t>(decimal.digits.size()) + exponent;
  if (dot != text.npos) decimal.digits += text.substr(dot + 1);
  const bool all_digits = std::all_of(decimal.digits.begin(), decimal.digits.end(),
                                      [](char c) { return c >= '0' && c <= '9'; });
  return all_digits && !decimal.digits.empty() ? std::optional(decimal) : std::nullopt;
}

}  // namespace

std::optional<TimePoint> parseNanoseconds(std::string_view text) {
  text = trim(text);
  if (const auto plain = parseInteger(text)) {
    return *plain >= 0 ? std::optional(fromNanoseconds(*plain)) : std::nullopt;
  }
  const auto decimal = decimalOf(text);
  if (!decimal || decimal->point <= 0 || decimal->point > 19) return std::nullopt;
  const auto point = static_cast<std::size_t>(decimal->point);
  std::string digits = decimal->digits;
  if (digits.find_first_not_of('0', std::min(point, digits.size())) != digits.npos)
    return std::nullopt;
  digits.resize(point, '0');
  const auto value = parseInteger(digits);
  return value ? std::optional(fromNanoseconds(*value)) : std::nullopt;
}

std::optional<TimePoint> parseSeconds(std::string_view text) {
  const auto dot = text.find('.');
  const bool plain = text.find_first_of("eE") == text.npos;
  const auto whole = parseInteger(text.substr(0, dot));
  if (plain && whole && dot != text.npos) {
    std::string digits(text.substr(dot + 1, 9));
    digits.resize(9, '0');
    const auto fraction = parseInteger(digits);
    constexpr std::int64_t kMost = 9'000'000'000;
    const bool fits = *whole >= -kMost && *whole <= kMost;
    if (!fraction || *fraction < 0 || !fits) return std::nullopt;
    const std::int64_t sign = text.starts_with('-') ? -1 : 1;
    return fromNanoseconds(*whole * 1'000'000'000 + sign * *fraction);
  }
  const auto seconds = parseNumber(text);
  if (!seconds || std::abs(*seconds) > 9e9) return std::nullopt;
  return TimePoint(durationFromSeconds(*seconds));
}

std::string whyDateDigits(std::string_view text) {
  text = trim(text);
  const bool whole_year = text.size() == 17 || text.size() == 20 || text.size() == 23;
  const bool short_year = text.size() == 15 || text.size() == 18 || text.size() == 21;
  const bool digits = std::ranges::all_of(text, [](char c) { return c >= '0' && c <= '9'; });
  if (!digits || !(whole_year || short_year)) return {};
  if (whole_year && !text.starts_with("19") && !text.starts_with("20")) return {};
  const std::string_view rest = text.substr(whole_year ? 4 : 2);  // MMDDHHMMSS…
  const auto isWithin = [&](std::size_t pair, std::int64_t least, std::int64_t most) {
    const auto value = parseInteger(rest.substr(2 * pair, 2));
    return value && *value >= least && *value <= most;
  };
  const bool date = isWithin(0, 1, 12) && isWithin(1, 1, 31);
  if (!date || !isWithin(2, 0, 23) || !isWithin(3, 0, 59) || !isWithin(4, 0, 59)) return {};
  return "`" + std::string(text) +
         "` has the digits of a date and a time of day; convert the stamps to nanoseconds since "
         "1970";
}

std::string whyNoStamp(std::string_view text) {
  text = trim(text);
  if (parseNanoseconds(text)) return {};
  if (std::string why = whyDateDigits(text); !why.empty()) return why;
  std::string why = "`" + std::string(text) + "` is no stamp in whole nanoseconds";
  if (text.find(';') != text.npos) {
    return why +
           ": semicolons separate the columns, and numbers have decimal commas; export the "
           "table with commas and decimal points";
  }
  const auto value = parseNumber(text);
  if (!value) return why;
  if (*value < 0.0) return why + ": it is negative";
  const double magnitude = std::abs(*value);
  const char *unit = "seconds", *factor = "1000000000";
  if (magnitude >= 1e14) {
    unit = "microseconds", factor = "1000";
  } else if (magnitude >= 1e11) {
    unit = "milliseconds", factor = "1000000";
  }
  return why + "; it looks like " + unit + ": multiply the column by " + factor +
         ", or let perdure doctor --data DRIVE --fix COPY do it";
}

Duration between(TimePoint a, TimePoint b) {
  std::int64_t ns = 0;
  if (!__builtin_sub_overflow(toNanoseconds(a), toNanoseconds(b), &ns)) return Duration(ns);
  return a < b ? Duration::min() : Duration::max();
}

Duration multipleOf(std::int64_t n, Duration d) {
  std::int64_t ns = 0;
  if (!__builtin_mul_overflow(n, d.count(), &ns)) return Duration(ns);
  return (n < 0) != (d.count() < 0) ? Duration::min() : Duration::max();
}

}  // namespace perdure::replay
