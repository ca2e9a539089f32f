#include "common/replay/files/stamp_order.h"

#include <algorithm>
#include <numeric>
#include <optional>

#include "common/base/algorithms/median.h"
#include "common/replay/files/counters.h"
#include "common/replay/files/stamps.h"
#include "common/replay/files/text_file.h"

namespace perdure::replay {
namespace {

using std::chrono::hours;
using Times = std::vector<TimePoint>;
using Kind = ClockChange::Kind;

constexpr std::size_t kFew = 3;        ///< number of strays accepted for any number of stamps
constexpr std::size_t kFewShare = 50;  ///< at most one stray stamp per this number of stamps
constexpr int kFarIntervals =
    32;  ///< a stray is farther outside its neighbours' stamps than this number of intervals

/// Reads the digits HHMMSS of a time of day, whose last digit counts `second`, with its fraction;
/// nothing if they are none.
std::optional<Duration> timeOfDay(TimePoint stamp, Duration second) {
  const Duration all = stamp.time_since_epoch();
  if (all < Duration{0}) return std::nullopt;
  const auto digits = all / second;
  const auto h = digits / 10'000 % 100, m = digits / 100 % 100, s = digits % 100;
  if (h >= 24 || m >= 60 || s >= 60) return std::nullopt;
  return second * (3600 * h + 60 * m + s) + all % second;
}

/// Indices of a longest subsequence of stamps that do not decrease.
std::vector<std::size_t> longestInOrder(const Times& stamps) {
  std::vector<std::size_t> ends,
      before(stamps.size());  // ends[k]: last index of the best k + 1 stamps
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

/// The median of the intervals that are positive.
Duration medianInterval(const Times& stamps) {
  std::vector<Duration> intervals;
  for (std::size_t i = 1; i < stamps.size(); ++i) {
    if (stamps[i] > stamps[i - 1]) intervals.push_back(between(stamps[i], stamps[i - 1]));
  }
  return medianOf(std::move(intervals));
}

bool areFew(std::size_t count, std::size_t all) {
  return 2 * count < all && count <= std::max(kFew, all / kFewShare);
}

/// The longest ordered sequence of stamps, used to judge the other stamps.
class Line {
 public:
  explicit Line(const Times& stamps) : stamps_(stamps) {
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

  const Times& stamps_;
  std::vector<std::size_t> indices_;  // indices in increasing order, with increasing stamps
  Times sorted_;
  Duration usual_{0};
};

/// Removes up to three stamps at either end that a long pause separates from the others.
void cutEnds(const Times& stamps, StampOrder& order) {
  auto& kept = order.kept;
  if (kept.size() < 20) return;
  Times sorted;
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

void dropRepeated(const Times& stamps, StampOrder& order) {
  const auto end =
      std::unique(order.kept.begin(), order.kept.end(),
                  [&](std::size_t a, std::size_t b) { return stamps[a] == stamps[b]; });
  order.repeated = static_cast<std::size_t>(order.kept.end() - end);
  order.kept.erase(end, order.kept.end());
}

/// The first stamp of which leading zeros of the nanoseconds are missing ("%d%d" of seconds and
/// nanoseconds); nothing if zeros do not put the stamps in order.
std::optional<std::size_t> firstJoined(const Times& stamps) {
  constexpr std::size_t kFraction = 9, kFewest = 3;
  std::vector<std::string> written;
  std::size_t longest = 0;
  for (const TimePoint stamp : stamps) {
    written.push_back(std::to_string(toNanoseconds(stamp)));
    longest = std::max(longest, written.back().size());
  }
  if (longest <= kFraction || std::is_sorted(stamps.begin(), stamps.end())) return std::nullopt;
  const std::size_t whole = longest - kFraction;
  std::optional<std::size_t> first;
  std::size_t count = 0;
  for (std::size_t i = 0; i < written.size(); ++i) {
    std::string& text = written[i];
    if (text.size() == longest) continue;
    if (text.size() <= whole) return std::nullopt;
    text.insert(whole, longest - text.size(), '0');
    ++count;
    if (!first) first = i;
  }
  if (count < kFewest) return std::nullopt;
  for (std::size_t i = 1; i < written.size(); ++i) {
    constexpr std::int64_t kSecond = 1'000'000'000;
    const auto before = parseInteger(written[i - 1]), after = parseInteger(written[i]);
    if (!before || !after || *after < *before || *after - *before > kSecond) return std::nullopt;
  }
  return first;
}

/// a + b, limited to ±292 years.
Duration sum(Duration a, Duration b) {
  return between(TimePoint(a), TimePoint(-std::max(b, -Duration::max())));
}

/// Finds the changes of a clock between consecutive stamps.
class ClockWalk {
 public:
  ClockWalk(const Times& stamps, const AreSame& same, const std::vector<ClockChange>& known)
      : stamps_(stamps),
        same_(same),
        known_(known),
        times_(stamps),
        usual_(medianInterval(stamps)) {
    if (usual_ <= Duration{0}) return;
    for (std::size_t i = 1; i < stamps.size(); ++i) back_ += stamps[i] < stamps[i - 1] ? 1 : 0;
    const auto [least, most] = std::minmax_element(stamps.begin(), stamps.end());
    least_ = *least, most_ = *most;
    if (!walk()) times_ = stamps, changes_.clear();
  }
  Times times() && { return std::move(times_); }
  std::vector<ClockChange> changes() && { return std::move(changes_); }

 private:
  static constexpr std::size_t kMostSet =
      8;  ///< most times that a clock is set; overlapping batches have more steps
  /// Steps back are changes of the clock only if there is at most one per this number of stamps.
  static constexpr std::size_t kOrdered = 20;
  static constexpr int kLost = 20;  ///< longest gap of lost samples, in intervals

  /// Returns false if there are too many steps for a clock that was set.
  bool walk() {
    Duration added{0};
    std::size_t set = 0;
    for (std::size_t i = 1; i < stamps_.size(); ++i) {
      if (auto change = changeAt(i)) {
        added = sum(added, change->added);
        change->continues = TimePoint(sum(change->after.time_since_epoch(), added));
        if (change->kind == Kind::kSet && ++set > kMostSet) return false;
        changes_.push_back(*std::move(change));
      }
      times_[i] = TimePoint(sum(stamps_[i].time_since_epoch(), added));
    }
    return true;
  }

  std::optional<ClockChange> changeAt(std::size_t i) const {
    const Duration step = between(stamps_[i], stamps_[i - 1]);
    const Duration pause =
        std::max<Duration>(std::chrono::milliseconds(250), multipleOf(3, usual_));
    ClockChange change{.index = i, .before = stamps_[i - 1], .after = stamps_[i], .usual = usual_};
    if (const ClockChange* set = knownAt(change)) {
      change.kind = Kind::kSet, change.added = set->added;
      return change;
    }
    if (step >= Duration{0} && step <= multipleOf(3, usual_)) return std::nullopt;
    const bool regular = i > kFew && goesOn(i - kFew - 1, kFew + 1) && goesOn(i, kFew + 1);
    if (regular && areDigits(change)) {
      change.kind = Kind::kDigits, change.common = true;
      return change;
    }
    if (step >= Duration{0} && step <= pause) return std::nullopt;
    const std::size_t behind = std::min(kFew + 1, stamps_.size() - i);
    if (step < Duration{0} && goesOn(i, behind) && findCounter(change, regular)) return change;
    if (!regular || kOrdered * back_ > stamps_.size()) return std::nullopt;
    // a step forward of up to a day is a pause
    if (step > Duration{0} && step <= hours(24)) return change;
    if (step < Duration{0} && (isSwap(i) || isMoved(i))) return std::nullopt;
    change.kind = Kind::kSet, change.added = between(TimePoint(usual_), TimePoint(step));
    return change;
  }

  /// Returns whether the stamps pass a full minute as digits of a time of day do, in ns, µs or ms.
  bool areDigits(const ClockChange& change) const {
    for (const Duration second : {Duration(1'000'000'000), Duration(1'000'000), Duration(1000)}) {
      // 0.5 to 2000 samples a second; other units are wrong
      if (usual_ > 2 * second || multipleOf(2000, usual_) < second) continue;
      const auto isTime = [&](TimePoint stamp) { return timeOfDay(stamp, second).has_value(); };
      if (!std::ranges::all_of(stamps_, isTime)) continue;
      const auto before = timeOfDay(change.before, second), after = timeOfDay(change.after, second);
      const Duration minute = second * 60, day = minute * 60 * 24;
      if (!before || !after || *after % minute > *before % minute) continue;
      const Duration step = (*after - *before + day) % day;
      if (step > Duration{0} && step <= std::max(second / 50, multipleOf(2, usual_))) return true;
    }
    return false;
  }

  /// Returns the change of another sensor's clock if it explains the step here.
  const ClockChange* knownAt(const ClockChange& here) const {
    const auto explains = [&](const ClockChange& set) {
      if (set.kind != Kind::kSet || set.added <= Duration{0}) return false;
      const Duration awaited = usual_ - set.added, step = between(here.after, here.before);
      const Duration most = std::min(multipleOf(2, usual_) / 5, set.added / 2);
      return std::chrono::abs(between(TimePoint(step), TimePoint(awaited))) < most &&
             between(here.before, set.before) < usual_ && between(set.after, here.after) < usual_ &&
             between(set.before, here.before) < multipleOf(3, usual_);
    };
    const auto set = std::find_if(known_.begin(), known_.end(), explains);
    return set == known_.end() ? nullptr : &*set;
  }

  /// Returns whether a step back is due to neighbours that changed places: it is very short, or it
  /// is short and spans no more stamps than usual. After a clock was set back, it spans them twice.
  bool isSwap(std::size_t i) const {
    const TimePoint before = stamps_[i - 1], after = stamps_[i];
    const Duration back = between(before, after);
    if (back <= std::chrono::milliseconds(50)) return true;
    if (back > multipleOf(3, usual_)) return false;
    const auto passed = static_cast<std::size_t>(back / usual_) + 1;
    std::size_t found = 0;
    for (std::size_t k = i - std::min(i, 2 * passed); k < std::min(stamps_.size(), i + 2 * passed);
         ++k) {
      if (stamps_[k] >= after && stamps_[k] <= before) ++found;
    }
    return 2 * found < 3 * passed;
  }

  /// Returns whether `count` stamps from `first` increase without a pause.
  bool goesOn(std::size_t first, std::size_t count) const {
    if (first + count > stamps_.size()) return false;
    for (std::size_t i = first + 1; i < first + count; ++i) {
      if (!isNext(stamps_[i - 1], stamps_[i])) return false;
    }
    return true;
  }
  bool isNext(TimePoint before, TimePoint after) const {
    return after > before && between(after, before) <= multipleOf(kLost, usual_);
  }

  /// Finds the counter whose length explains the step back best. Between regular stamps it must
  /// agree to about a sample; if all stamps lie within one period of the counter, to 1 % and 20
  /// samples.
  bool findCounter(ClockChange& change, bool regular) const {
    Duration least = Duration::max();
    for (const Counter& counter : knownCounters()) {
      const Duration gap = counter.length - between(change.before, change.after);
      const bool whole = least_ >= TimePoint{} && most_ < TimePoint{} + counter.length;
      const Duration lost = std::min(counter.length / 100, multipleOf(kLost, usual_));
      const Duration most = counter.of_cycles
                                ? multipleOf(2, usual_)
                                : std::max(multipleOf(3, usual_), whole ? lost : usual_);
      if (!(whole || regular) || gap <= Duration{0} || gap > most ||
          multipleOf(whole ? 2 : 10, most) > counter.length)
        continue;
      if (const Duration off = std::chrono::abs(gap - usual_); off < least) {
        least = off;
        change.kind = Kind::kCounter, change.added = counter.length, change.counter = counter.name;
      }
    }
    return least != Duration::max();
  }

  /// Returns whether the stamps from i on are lines out of order: they fill a gap between earlier
  /// times, or repeat earlier samples.
  bool isMoved(std::size_t i) const {
    std::size_t end = i + 1;
    while (end < stamps_.size() && isNext(stamps_[end - 1], stamps_[end])) ++end;
    const Duration added = between(times_[i - 1], stamps_[i - 1]);
    const auto corrected = [&](std::size_t k) {
      return TimePoint(sum(stamps_[k].time_since_epoch(), added));
    };
    using Sample = std::pair<TimePoint, std::size_t>;
    std::vector<Sample> earlier;
    for (std::size_t k = 0; k < i; ++k) earlier.emplace_back(times_[k], k);
    std::sort(earlier.begin(), earlier.end());
    const TimePoint first = corrected(i), last = corrected(end - 1);
    const auto low = std::lower_bound(earlier.begin(), earlier.end(), Sample(first, 0)),
               high = std::upper_bound(low, earlier.end(), Sample(last, i));
    std::size_t inside = 0, repeated = 0;
    for (std::size_t k = i; k < end && stamps_[k] <= stamps_[i - 1]; ++k, ++inside) {
      const auto at = std::lower_bound(low, high, Sample(corrected(k), 0));
      if (at != high && at->first == corrected(k) && same_(at->second, k)) ++repeated;
    }
    if (2 * repeated > inside) return true;
    constexpr std::ptrdiff_t kAmong = 10;
    if (kAmong * (high - low) > static_cast<std::ptrdiff_t>(inside)) return false;
    return (low != earlier.begin() && isNext((low - 1)->first, first)) ||
           (high != earlier.end() && isNext(last, high->first));
  }

  const Times& stamps_;
  const AreSame& same_;
  const std::vector<ClockChange>& known_;
  Times times_;
  std::vector<ClockChange> changes_;
  Duration usual_;
  TimePoint least_, most_;
  std::size_t back_ = 0;  ///< number of steps back
};

}  // namespace

StampOrder orderOf(const std::vector<TimePoint>& given, const AreSame& same,
                   const std::vector<ClockChange>& known) {
  StampOrder order;
  ClockWalk walk(given, same, known);
  order.changes = std::move(walk).changes();
  if (const auto joined = firstJoined(given)) {
    const TimePoint before = given[*joined == 0 ? 0 : *joined - 1], after = given[*joined];
    order.changes = {{.kind = Kind::kJoined,
                      .index = *joined,
                      .before = before,
                      .after = after,
                      .continues = after,
                      .common = true}};
  }
  order.times = std::move(walk).times();
  const Times& stamps = order.times;
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
  // Removes pauses that lines out of order fill.
  std::erase_if(order.changes, [&](const ClockChange& change) {
    const auto next =
        std::lower_bound(order.kept.begin(), order.kept.end(), change.continues,
                         [&](std::size_t i, TimePoint time) { return stamps[i] < time; });
    return change.kind == Kind::kPause && next != order.kept.begin() &&
           between(change.continues, stamps[*(next - 1)]) < between(change.after, change.before);
  });
  return order;
}

}  // namespace perdure::replay
