#include "services/ros2/core/clocks.h"

#include <gtest/gtest.h>

#include <random>

namespace perdure::ros2 {
namespace {

constexpr std::int64_t kMs = 1'000'000, kSecond = 1'000'000'000;
constexpr std::int64_t kWall = 1'700'000'000 * kSecond;

ros::Time stampOf(std::int64_t ns) {
  return {static_cast<std::int32_t>(ns / kSecond), static_cast<std::uint32_t>(ns % kSecond)};
}

Clocks clocksOf(bool imu_shared) {
  Clocks clocks(std::chrono::seconds(5));
  clocks.addInput("cam0", true);
  clocks.addInput("imu", imu_shared);
  return clocks;
}

TEST(Ros2Clocks, TakesStampsOfOneClockAsTheyAre) {
  Clocks clocks = clocksOf(true);
  EXPECT_EQ(*clocks.place("cam0", stampOf(kWall), 100), fromNanoseconds(kWall));
  EXPECT_EQ(*clocks.place("imu", stampOf(kWall - 40 * kMs), 200), fromNanoseconds(kWall - 40 * kMs))
      << "an IMU may be ahead of or behind the camera, by what messages take";
}

TEST(Ros2Clocks, RefusesStampsOfAnotherEpochAndSaysHowFar) {
  Clocks clocks = clocksOf(true);
  ASSERT_TRUE(clocks.place("cam0", stampOf(kWall), 0));
  const auto refused = clocks.place("imu", stampOf(12 * kSecond), kMs);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, "stamp_elsewhere");
  EXPECT_NE(refused.error().detail.find("set in.imu.clock: own"), std::string::npos);
  EXPECT_NE(refused.error().detail.find("behind those of cam0"), std::string::npos);
}

TEST(Ros2Clocks, RefusesStampsThatAreNone) {
  Clocks clocks = clocksOf(true);
  EXPECT_EQ(clocks.place("cam0", {0, 0}, 0).error().code, "stamp_missing");
  EXPECT_EQ(clocks.place("cam0", {-5, 0}, 0).error().code, "stamp_malformed");
  EXPECT_EQ(clocks.place("cam0", {5, 4'000'000'000U}, 0).error().code, "stamp_malformed");
}

TEST(Ros2Clocks, RefusesOldStampsButBeginsAnewWithADriverThatDoes) {
  Clocks clocks = clocksOf(true);
  ASSERT_TRUE(clocks.place("cam0", stampOf(kWall), 0));
  EXPECT_EQ(clocks.place("cam0", stampOf(kWall), kMs).error().code, "stamp_not_newer");
  EXPECT_EQ(clocks.place("cam0", stampOf(kWall - 100 * kMs), kMs).error().code, "stamp_not_newer");
  EXPECT_TRUE(clocks.place("cam0", stampOf(kWall - 60 * kSecond), 2 * kMs)) << "a bag in a loop";
  EXPECT_TRUE(clocks.place("cam0", stampOf(kWall - 59 * kSecond), 3 * kMs));
}

/// A clock of its own, messages late by 1 to 20 ms: what is left is the least delay of both.
TEST(Ros2Clocks, PlacesAClockOfItsOwnByTheLeastDelays) {
  Clocks clocks = clocksOf(false);
  std::mt19937 dice(5);
  std::uniform_int_distribution<std::int64_t> late(kMs, 20 * kMs);
  EXPECT_EQ(clocks.place("imu", stampOf(kSecond), 0).error().code, "clock_unknown");
  constexpr std::int64_t kOwn = 9000 * kSecond;
  TimePoint last;
  double most = 0;
  for (int i = 1; i < 2000; ++i) {
    const std::int64_t t = i * 10 * kMs;
    if (i % 5 == 0) (void)clocks.place("cam0", stampOf(kWall + t), t + late(dice));
    const auto placed = clocks.place("imu", stampOf(kOwn + t), t + late(dice));
    if (i < 60) continue;
    ASSERT_TRUE(placed) << i << placed.error().code;
    EXPECT_GT(*placed, last);
    last = *placed;
    most = std::max(most, std::abs(toSeconds(*placed - fromNanoseconds(kWall + t))));
  }
  EXPECT_LT(most, 0.010);
  EXPECT_LT(std::abs(toSeconds(last - fromNanoseconds(kWall + 19'990 * kMs))), 0.002);
}

TEST(Ros2Clocks, FindsAnOwnClockAgainThatJumps) {
  Clocks clocks = clocksOf(false);
  const auto run = [&](std::int64_t own, int from, int to) {
    std::size_t placed = 0;
    for (int i = from; i < to; ++i) {
      const std::int64_t t = i * 10 * kMs;
      (void)clocks.place("cam0", stampOf(kWall + t), t);
      const auto at = clocks.place("imu", stampOf(own + t), t);
      if (!at) continue;
      ++placed;
      EXPECT_NEAR(toSeconds(*at - fromNanoseconds(kWall + t)), 0, 1e-3);
    }
    return placed;
  };
  EXPECT_GE(run(9000 * kSecond, 1, 200), 140u);
  EXPECT_GE(run(20 * kSecond, 200, 400), 140u);
}

}  // namespace
}  // namespace perdure::ros2
