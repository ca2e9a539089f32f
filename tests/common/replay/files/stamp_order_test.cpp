#include "common/replay/files/stamp_order.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "common/replay/files/stamps.h"

namespace perdure::replay {
namespace {

using std::chrono::milliseconds, std::chrono::seconds;
using Kind = ClockChange::Kind;

std::vector<TimePoint> every(std::int64_t interval_ns, std::size_t count) {
  std::vector<TimePoint> stamps;
  for (std::size_t i = 0; i < count; ++i) {
    stamps.push_back(
        fromNanoseconds(1'000'000'000'000'000'000 + interval_ns * static_cast<std::int64_t>(i)));
  }
  return stamps;
}
constexpr std::int64_t kInterval = 10'000'000;

TEST(StampOrder, KeepsAllThatIncreases) {
  const auto order = orderOf(every(kInterval, 100));
  EXPECT_EQ(order.kept.size(), 100U);
  EXPECT_EQ(order.moved + order.strays + order.repeated, 0U);
  EXPECT_TRUE(orderOf({}).kept.empty());
}

// 32 times an interval of 31 years exceeds the range of 64-bit nanoseconds.
TEST(StampOrder, HoldsAnyStamps) {
  std::vector<TimePoint> stamps;
  for (const double years : {0.0, 31.7, 63.4, 95.1, 126.8, 79.2}) {
    stamps.push_back(fromNanoseconds(static_cast<std::int64_t>(years * 3.15576e16)));
  }
  const auto order = orderOf(stamps);
  EXPECT_EQ(order.strays, 0U) << "half an interval is not far";
  EXPECT_EQ(order.moved, 1U);
  EXPECT_EQ(between(TimePoint::max(), TimePoint::min()), Duration::max());
  EXPECT_EQ(between(TimePoint::min(), TimePoint::max()), Duration::min());
  EXPECT_EQ(multipleOf(32, Duration::max()), Duration::max());
  EXPECT_EQ(multipleOf(2, Duration::min()), Duration::min());
  EXPECT_EQ(multipleOf(3, Duration(-7)), Duration(-21));
}

TEST(StampOrder, LeavesOutTheOneThatIsFarAndNotAllBehindIt) {
  for (const std::int64_t by : {3600ll * 1'000'000'000, -3600ll * 1'000'000'000, 2'000'000'000ll}) {
    for (const std::size_t at : {std::size_t{0}, std::size_t{40}, std::size_t{119}}) {
      if (by == 2'000'000'000ll && at != 40) continue;  // the first or last stamp may be correct
      auto stamps = every(kInterval, 120);
      stamps[at] += Duration(by);
      const auto order = orderOf(stamps);
      EXPECT_EQ(order.strays, 1U) << by << " at " << at;
      EXPECT_EQ(order.kept.size(), 119U);
      EXPECT_EQ(std::count(order.kept.begin(), order.kept.end(), at), 0);
      EXPECT_EQ(order.moved, 0U);
    }
  }
}

TEST(StampOrder, SortsWhatIsNotSortedAtAll) {
  std::mt19937_64 random(3);
  auto stamps = every(kInterval, 500);
  const auto sorted = stamps;
  std::shuffle(stamps.begin(), stamps.end(), random);
  const auto order = orderOf(stamps);
  ASSERT_EQ(order.kept.size(), 500U);
  for (std::size_t i = 0; i < 500; ++i) EXPECT_EQ(stamps[order.kept[i]], sorted[i]);
  EXPECT_GT(order.moved, 400U);
  auto reversed = sorted;
  std::reverse(reversed.begin(), reversed.end());
  EXPECT_EQ(orderOf(reversed).kept.size(), 500U);
}

TEST(StampOrder, SortsNeighboursThatChangedPlacesAndARowThatFillsAHole) {
  auto stamps = every(kInterval, 100);
  std::swap(stamps[10], stamps[11]);
  std::rotate(stamps.begin() + 50, stamps.begin() + 90, stamps.begin() + 91);  // index 90 moves to
                                                                               // 50
  const auto order = orderOf(stamps);
  EXPECT_EQ(order.kept.size(), 100U);
  EXPECT_EQ(order.strays, 0U);
  EXPECT_EQ(order.moved, 2U);
}

TEST(StampOrder, LeavesOutWhatCameBefore) {
  auto stamps = every(kInterval, 10);
  stamps.insert(stamps.begin() + 5, stamps[4]);
  const auto order = orderOf(stamps);
  EXPECT_EQ(order.repeated, 1U);
  EXPECT_EQ(order.kept.size(), 10U);
}

TEST(StampOrder, APauseIsNoFault) {
  auto stamps = every(kInterval, 100);
  for (std::size_t i = 50; i < 100; ++i) stamps[i] += std::chrono::hours(1);
  EXPECT_EQ(orderOf(stamps).kept.size(), 100U);
}

TEST(StampOrder, WhateverComesItIncreases) {
  std::mt19937_64 random(8);
  for (int run = 0; run < 200; ++run) {
    std::vector<TimePoint> stamps(random() % 60);
    for (auto& stamp : stamps) {
      stamp = random() % 4 == 0 ? TimePoint(Duration(static_cast<std::int64_t>(random() >> 1)))
                                : TimePoint(Duration(static_cast<std::int64_t>(random() % 100)));
    }
    const auto order = orderOf(stamps);
    EXPECT_EQ(order.kept.size() + order.strays + order.repeated, stamps.size());
    for (std::size_t i = 1; i < order.kept.size(); ++i) {
      EXPECT_LT(stamps[order.kept[i - 1]], stamps[order.kept[i]]);
    }
  }
}

/// Stamps as `stampOf` writes the true times of `count` samples.
template <class Written>
StampOrder orderWritten(std::size_t count, const Written& stampOf) {
  std::vector<TimePoint> stamps;
  for (const TimePoint time : every(kInterval, count)) {
    stamps.push_back(TimePoint(stampOf(time - TimePoint(seconds(1'000'000'000)))));
  }
  return orderOf(stamps, [](std::size_t, std::size_t) { return false; });
}

/// All stamps are kept, at regular times.
void expectRegular(const StampOrder& order, std::size_t count) {
  ASSERT_EQ(order.kept.size(), count);
  for (std::size_t i = 1; i < count; ++i) {
    EXPECT_EQ(order.kept[i], i);
    EXPECT_EQ(order.times[i] - order.times[i - 1], Duration(kInterval)) << i;
  }
}

TEST(Clocks, ACounterThatCameRoundGoesOn) {
  const struct {
    Duration length;
    const char* name;
  } kCounters[] = {{Duration(4'294'967'296'000), "32 bits of µs"},
                   {milliseconds(1 << 24), "24 bits of ms"},
                   {milliseconds(1 << 16), "16 bits of ms"},
                   {Duration(4'294'967'296), "32 bits of ns"},
                   {milliseconds(1 << 20), "20 bits of ms"},
                   {Duration(1LL << 48), "48 bits of ns"},
                   {std::chrono::hours(24), "a day"},
                   {std::chrono::hours(7 * 24), "a week"}};
  for (const auto& [length, name] : kCounters) {
    for (const std::size_t before : {2, 150, 297}) {
      const auto order = orderWritten(300, [&](Duration time) {
        return (length - before * Duration(kInterval) + time + Duration(3'000'000)) % length;
      });
      expectRegular(order, 300);
      ASSERT_EQ(order.changes.size(), 1U) << name << before;
      EXPECT_EQ(order.changes[0].kind, Kind::kCounter);
      EXPECT_EQ(order.changes[0].counter, name);
      EXPECT_EQ(order.changes[0].index, before);
      EXPECT_EQ(order.changes[0].added, length);
    }
  }
}

TEST(Clocks, DigitsOfATimeOfDayAreRecognisedAtAFullMinute) {
  for (const int start_s : {45'058, 3'598, 86'398}) {
    for (const std::int64_t scale : {1, 1000, 1'000'000}) {
      const auto order = orderWritten(300, [&](Duration time) {
        const Duration day = seconds(start_s) + time;
        const auto s = day / seconds(1) % 86'400;
        return (seconds(s / 3600 * 10'000 + s / 60 % 60 * 100 + s % 60) + day % seconds(1)) / scale;
      });
      ASSERT_EQ(order.changes.size(), 1U) << start_s << " " << scale;
      EXPECT_EQ(order.changes[0].kind, Kind::kDigits);
    }
  }
}

TEST(Clocks, SecondsAndNanosecondsJoinedWithoutZerosAreRecognised) {
  for (const std::int64_t start : {1000, 1'403'636'579}) {
    std::vector<TimePoint> stamps;
    for (int i = 0; i < 300; ++i) {
      stamps.push_back(fromNanoseconds(
          std::stoll(std::to_string(start + i / 100) + std::to_string(i % 100 * 10'000'000 + 5))));
    }
    const auto order = orderOf(stamps);
    ASSERT_EQ(order.changes.size(), 1U);
    EXPECT_EQ(order.changes[0].kind, Kind::kJoined);
    EXPECT_EQ(order.changes[0].index, 0U);
  }
}

TEST(Clocks, LostSamplesAndOtherCountersAreNoDigits) {
  for (const std::int64_t interval_ns : {50'000'000, 5'000'000}) {
    for (std::int64_t lost = 2; lost < 60; ++lost) {
      for (const std::int64_t start_ms : {100, 59'950, 1'000'000}) {
        std::vector<TimePoint> stamps;
        for (std::int64_t i = 0; i < 40; ++i) {
          const std::int64_t passed = i < 20 ? i : i + lost;
          stamps.emplace_back(milliseconds(start_ms) + Duration(interval_ns * passed));
        }
        for (const auto& change : orderOf(stamps).changes) EXPECT_NE(change.kind, Kind::kDigits);
      }
    }
  }
}

TEST(Clocks, OfTwoCountersTheOneIsTakenThatContinuesTheStamps) {
  for (const auto& [hz, name] : {std::pair(72'000'000ll, "32 bits of cycles at 72 MHz"),
                                 {168'000'000ll, "32 bits of cycles at 168 MHz"},
                                 {25'600ll * 256, "24 bits of 39.0625 µs (a sensor's time)"}}) {
    auto stamps = every(kInterval, 400);
    const Duration length(static_cast<std::int64_t>(4294967296.0 / static_cast<double>(hz) * 1e9));
    for (std::size_t i = 0; i < stamps.size(); ++i) {
      stamps[i] = TimePoint((static_cast<std::int64_t>(i) - 200) * milliseconds(10) +
                            (i < 200 ? length : Duration{0}));
    }
    const auto order = orderOf(stamps);
    ASSERT_EQ(order.changes.size(), 1U) << name;
    EXPECT_EQ(order.changes[0].counter, name);
  }
}

TEST(Clocks, APauseThatEndsShortlyAfterAFullMinuteIsNoTimeOfDay) {
  for (const auto& [pause, kind] :
       {std::pair(milliseconds(40'200), Kind::kPause), {milliseconds(40'000), Kind::kDigits}}) {
    auto stamps = every(kInterval, 600);
    for (std::size_t i = 0; i < 600; ++i) {
      stamps[i] = TimePoint(seconds(1757) + static_cast<std::int64_t>(i) * milliseconds(10) +
                            (i < 300 ? Duration{0} : pause));
    }
    const auto order = orderOf(stamps);
    ASSERT_EQ(order.changes.size(), 1U);
    EXPECT_EQ(order.changes[0].kind, kind) << pause.count();
  }
}

TEST(Clocks, ACounterMayComeRoundOftenAndFromAnyStart) {
  const Duration length(std::int64_t{1000} << 16);  // 65.5 ms
  expectRegular(orderWritten(100, [&](Duration time) { return time % length; }), 100);
  const auto order = orderWritten(
      1000, [&](Duration time) { return seconds(1'700'000'000) + time % Duration(1LL << 32); });
  expectRegular(order, 1000);
  EXPECT_EQ(order.changes.size(), 2U);
}

TEST(Clocks, AClockThatWasSetGoesOnAfterAnInterval) {
  for (const Duration by : {Duration(milliseconds(-300)), Duration(seconds(-2)),
                            Duration(std::chrono::hours(-5)), Duration(seconds(1'758'000'000))}) {
    const auto order = orderWritten(600, [&](Duration time) {
      return seconds(100'000) + time + (time >= seconds(3) ? by : Duration{0});
    });
    expectRegular(order, 600);
    ASSERT_EQ(order.changes.size(), 1U);
    EXPECT_EQ(order.changes[0].kind, Kind::kSet);
    EXPECT_EQ(order.changes[0].index, 300U);
    EXPECT_EQ(order.changes[0].added, -by);
  }
}

TEST(Clocks, APauseIsNamedAndNothingChanged) {
  const auto order = orderWritten(
      600, [&](Duration time) { return time + (time >= seconds(3) ? seconds(3600) : seconds(0)); });
  ASSERT_EQ(order.changes.size(), 1U);
  EXPECT_EQ(order.changes[0].kind, Kind::kPause);
  EXPECT_EQ(order.times[300] - order.times[299], seconds(3600) + Duration(kInterval));
}

TEST(Clocks, BlocksOfLinesAtAnotherPlaceAreSorted) {
  const auto expectSorted = [](std::vector<TimePoint> stamps, std::size_t kept) {
    const auto order = orderOf(stamps);
    EXPECT_TRUE(order.changes.empty());
    EXPECT_EQ(order.kept.size(), kept);
  };
  auto stamps = every(kInterval, 600);
  std::rotate(stamps.begin(), stamps.begin() + 200, stamps.end());
  expectSorted(stamps, 600);  // the first third of the stamps is at the end
  stamps = every(kInterval, 600);
  std::rotate(stamps.begin() + 100, stamps.begin() + 300, stamps.begin() + 400);
  expectSorted(stamps, 600);  // two blocks have changed places
  stamps = every(kInterval, 600);
  stamps.insert(stamps.end(), stamps.begin() + 500, stamps.begin() + 550);
  expectSorted(stamps, 600);  // some lines occur twice
}

TEST(Clocks, OverlappingBatchesAreNoClockThatWasSet) {
  std::vector<TimePoint> stamps;  // each batch of ten begins 0.1 s before the end of the last
  for (const TimePoint time : every(200'000'000, 30)) {
    for (int i = 0; i < 30; ++i) stamps.push_back(time + i * Duration(kInterval));
  }
  const auto order = orderOf(stamps);
  EXPECT_TRUE(order.changes.empty());
  EXPECT_LT(order.times.back() - order.times.front(), seconds(7));
}

}  // namespace
}  // namespace perdure::replay
