#include "common/replay/files/stamps.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace perdure::replay {
namespace {

using testing::HasSubstr;

std::vector<TimePoint> every(std::int64_t interval_ns, std::size_t count) {
  std::vector<TimePoint> stamps;
  for (std::size_t i = 0; i < count; ++i) {
    stamps.push_back(
        fromNanoseconds(1'000'000'000'000'000'000 + interval_ns * static_cast<std::int64_t>(i)));
  }
  return stamps;
}
constexpr std::int64_t kInterval = 10'000'000;

TEST(Stamps, AreWholeNanosecondsHoweverTheyAreSpelled) {
  const auto expectStamp = [](const char* text, std::int64_t ns) {
    const auto stamp = parseNanoseconds(text);
    ASSERT_TRUE(stamp) << text;
    EXPECT_EQ(toNanoseconds(*stamp), ns) << text;
    EXPECT_EQ(whyNoStamp(text), "");
  };
  expectStamp("1403636579763555584", 1403636579763555584);
  expectStamp(" +5 ", 5);
  expectStamp("1403636579763555584.0", 1403636579763555584);
  expectStamp("1403636579763555584.", 1403636579763555584);
  expectStamp("1.403636579763555584e+18", 1403636579763555584);
  expectStamp("1.000000000010000000e+18", 1000000000010000000);
  expectStamp("1E3", 1000);
  expectStamp("0.0", 0);
}

TEST(Stamps, ThatAreNoNanosecondsSayWhatTheyLookLike) {
  for (const char* text : {"", "x", "-5", "1.5", "1e30", "nan", "0x10", "1.5.2", "1e", "12 13"}) {
    EXPECT_FALSE(parseNanoseconds(text)) << text;
    EXPECT_THAT(whyNoStamp(text), HasSubstr("no stamp")) << text;
  }
  EXPECT_THAT(whyNoStamp("1403636579.763555"), HasSubstr("looks like seconds"));
  EXPECT_THAT(whyNoStamp("1403636579763.5"), HasSubstr("looks like milliseconds"));
  EXPECT_THAT(whyNoStamp("1403636579763555.5"), HasSubstr("looks like microseconds"));
}

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
      if (by == 2'000'000'000ll && at != 40) continue;  // at an end the stamp may be correct
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

}  // namespace
}  // namespace perdure::replay
