#include "common/replay/files/stamps.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numeric>

#include "common/base/algorithms/median.h"
#include "common/replay/files/text_file.h"

namespace perdure::replay {
namespace {

constexpr std::size_t kFew = 3;        ///< number of strays accepted for any number of stamps
constexpr std::size_t kFewShare = 50;  ///< one stray per this number of stamps
constexpr int kFarIntervals = 32;      ///< distance from the neighbours' stamps, in intervals

/// A decimal number as digits, and the position of its point from their start.
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

/// Indices of a longest subsequence of stamps that do not decrease.
std::vector<std::size_t> longestInOrder(const std::vector<TimePoint>& stamps) {
  std::vector<std::size_t> ends, before(stamps.size());  // ends[k]: end of the best k + 1
  for (std::size_t i = 0; i < stamps.size(); ++i) {
    const auto at =
        std::upper_bound(ends.begin(), ends.end(), stamps[i],
                         [&](TimePoint time, std::size_t j) { return time < stamps[j]; });
    before[i] = at == ends.begin() ? stamps.size() : *(at - 1);
    if (at == ends.end())
      ends.push_back(i);
    else
      *at = i;
  }
  std::vector<std::size_t> list(ends.size());
  for (std::size_t k = ends.size(), i = ends.empty() ? 0 : ends.back(); k > 0; i = before[i]) {
    list[--k] = i;
  }
  return list;
}

Duration medianInterval(const std::vector<TimePoint>& sorted) {
  std::vector<Duration> intervals;
  for (std::size_t i = 1; i < sorted.size(); ++i) {
    intervals.push_back(between(sorted[i], sorted[i - 1]));
  }
  return medianOf(std::move(intervals));
}

bool areFew(std::size_t count, std::size_t all) {
  return 2 * count < all && count <= std::max(kFew, all / kFewShare);
}

/// The longest ordered sequence of stamps, used to judge the other stamps.
class Line {
 public:
  explicit Line(const std::vector<TimePoint>& stamps) : stamps_(stamps) {
    indices_ = longestInOrder(stamps);
    for (const std::size_t i : indices_) sorted_.push_back(stamps[i]);
    usual_ = medianInterval(sorted_);
  }
  const std::vector<std::size_t>& indices() const { return indices_; }

  /// Returns true if the stamp is far outside its neighbours' stamps and does not fill a gap
  /// elsewhere.
  bool isStray(std::size_t index) const {
    const auto next = std::lower_bound(indices_.begin(), indices_.end(), index);
    const TimePoint stamp = stamps_[index];
    Duration outside{0};
    if (next != indices_.end()) outside = std::max(outside, between(stamp, stamps_[*next]));
    if (next != indices_.begin()) {
      outside = std::max(outside, between(stamps_[*(next - 1)], stamp));
    }
    return outside > multipleOf(kFarIntervals, usual_) && !fillsHole(stamp);
  }

 private:
  bool fillsHole(TimePoint stamp) const {
    const auto behind = std::upper_bound(sorted_.begin(), sorted_.end(), stamp);
    if (behind == sorted_.begin() || behind == sorted_.end()) return false;
    return multipleOf(2, between(*behind, *(behind - 1))) > multipleOf(3, usual_);
  }

  const std::vector<TimePoint>& stamps_;
  std::vector<std::size_t> indices_;  // increasing, as are their stamps
  std::vector<TimePoint> sorted_;
  Duration usual_{0};
};

/// Removes a few stamps before or after a long pause at the ends.
void cutEnds(const std::vector<TimePoint>& stamps, StampOrder& order) {
  auto& kept = order.kept;
  if (kept.size() < 20) return;
  std::vector<TimePoint> sorted;
  for (const std::size_t i : kept) sorted.push_back(stamps[i]);
  const Duration pause =
      std::max<Duration>(std::chrono::seconds(10), multipleOf(1000, medianInterval(sorted)));
  for (std::size_t few = kFew; few > 0; --few) {
    if (between(sorted[few], sorted[few - 1]) > pause) {
      kept.erase(kept.begin(), kept.begin() + static_cast<std::ptrdiff_t>(few));
      order.strays += few;
      break;
    }
  }
  for (std::size_t few = kFew; few > 0; --few) {
    const std::size_t first = sorted.size() - few;
    if (between(sorted[first], sorted[first - 1]) > pause) {
      kept.resize(kept.size() - few);
      order.strays += few;
      break;
    }
  }
}

void dropRepeated(const std::vector<TimePoint>& stamps, StampOrder& order) {
  const auto end =
      std::unique(order.kept.begin(), order.kept.end(),
                  [&](std::size_t a, std::size_t b) { return stamps[a] == stamps[b]; });
  order.repeated = static_cast<std::size_t>(order.kept.end() - end);
  order.kept.erase(end, order.kept.end());
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

std::string whyNoStamp(std::string_view text) {
  text = trim(text);
  if (parseNanoseconds(text)) return {};
  std::string why = "`" + std::string(text) + "` is no stamp in whole nanoseconds";
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

StampOrder orderOf(const std::vector<TimePoint>& stamps) {
  StampOrder order;
  order.kept.resize(stamps.size());
  std::iota(order.kept.begin(), order.kept.end(), 0);
  if (!std::is_sorted(stamps.begin(), stamps.end())) {
    const Line line(stamps);
    std::vector<bool> in_line(stamps.size(), false);
    for (const std::size_t i : line.indices()) in_line[i] = true;
    std::vector<bool> stray(stamps.size(), false);
    for (std::size_t i = 0; i < stamps.size(); ++i) {
      if (in_line[i]) continue;
      ++order.moved;
      stray[i] = line.isStray(i);
    }
    const auto strays = static_cast<std::size_t>(std::count(stray.begin(), stray.end(), true));
    const bool mostly_sorted = order.moved <= std::max(kFew, stamps.size() / 5);
    if (mostly_sorted && areFew(strays, stamps.size())) {
      order.strays = strays;
      order.moved -= strays;
      std::erase_if(order.kept, [&](std::size_t i) { return stray[i]; });
    }
    std::stable_sort(order.kept.begin(), order.kept.end(),
                     [&](std::size_t a, std::size_t b) { return stamps[a] < stamps[b]; });
  }
  dropRepeated(stamps, order);
  cutEnds(stamps, order);
  return order;
}

}  // namespace perdure::replay
