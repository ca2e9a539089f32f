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

std::string reasonOf(const Result<TimePoint>& placed) { return placed ? "" : placed.error().code; }

/// Uses both drivers for a while, so that the common clock becomes known.
void settle(Clocks& clocks, std::int64_t until) {
  for (std::int64_t t = until - 100 * kMs; t <= until; t += 20 * kMs) {
    (void)clocks.place("cam0", stampOf(kWall + t), t);
    (void)clocks.place("imu", stampOf(kWall + t), t);
  }
}

TEST(Ros2Clocks, TakesStampsOfOneClockAsTheyAre) {
  Clocks clocks = clocksOf(true);
  EXPECT_EQ(reasonOf(clocks.place("cam0", stampOf(kWall), kMs)), "clock_unknown");
  EXPECT_EQ(reasonOf(clocks.place("imu", stampOf(kWall), 2 * kMs)), "clock_unknown");
  EXPECT_EQ(reasonOf(clocks.place("cam0", stampOf(kWall + 50 * kMs), 51 * kMs)), "clock_unknown");
  EXPECT_EQ(*clocks.place("imu", stampOf(kWall + 10 * kMs), 52 * kMs),
            fromNanoseconds(kWall + 10 * kMs))
      << "an IMU may be ahead of or behind the camera, by what messages take";
}

TEST(Ros2Clocks, TakesAnInputThatIsAloneAfterHalfASecond) {
  Clocks clocks = clocksOf(true);
  for (int i = 0; i < 5; ++i)
    EXPECT_FALSE(clocks.place("cam0", stampOf(kWall + i * 100 * kMs), (1 + i * 100) * kMs)) << i;
  EXPECT_TRUE(clocks.place("cam0", stampOf(kWall + 500 * kMs), 501 * kMs));
}

TEST(Ros2Clocks, RefusesStampsOfAnotherEpochAndSaysHowFar) {
  Clocks clocks = clocksOf(true);
  Result<TimePoint> refused;
  for (int i = 0; i < 200; ++i) {
    const std::int64_t t = (1 + i * 10) * kMs;
    const bool taken = clocks.place("cam0", stampOf(kWall + t), t).has_value();
    refused = clocks.place("imu", stampOf(12 * kSecond + t), t);
    EXPECT_EQ(taken, i >= 50);
    EXPECT_EQ(reasonOf(refused), taken ? "stamp_elsewhere" : "clock_unknown");
  }
  EXPECT_NE(refused.error().detail.find("set in.imu.clock: own"), std::string::npos);
  EXPECT_NE(refused.error().detail.find("behind those of cam0"), std::string::npos);
}

/// The first message has a stamp of another clock, and so has every second message after it.
TEST(Ros2Clocks, OneInputsWrongStampsNeverBecomeTheClock) {
  Clocks clocks = clocksOf(true);
  std::size_t good = 0;
  for (int i = 0; i < 200; ++i) {
    const std::int64_t t = (1 + i * 10) * kMs;
    EXPECT_FALSE(clocks.place("imu", stampOf(kWall + t + 3600 * kSecond), t)) << i;
    good += clocks.place("cam0", stampOf(kWall + t), t).has_value();
    good += clocks.place("imu", stampOf(kWall + t + kMs), t).has_value();
  }
  EXPECT_GT(good, 290u) << "a camera alone for half a second, then both";
}

TEST(Ros2Clocks, FollowsAClockThatIsSetOnceBothDriversDo) {
  Clocks clocks = clocksOf(true);
  settle(clocks, kSecond);
  const auto stamp = [](std::int64_t t) { return stampOf(kWall - 900 * kSecond + t); };
  const auto alone = clocks.place("imu", stamp(1010 * kMs), 1010 * kMs);
  ASSERT_EQ(reasonOf(alone), "stamp_elsewhere");
  EXPECT_NE(alone.error().detail.find("those of cam0"), std::string::npos);
  EXPECT_FALSE(clocks.place("cam0", stamp(1010 * kMs), 1010 * kMs));
  EXPECT_FALSE(clocks.place("imu", stamp(1020 * kMs), 1020 * kMs)) << "one against one";
  EXPECT_TRUE(clocks.place("cam0", stamp(1060 * kMs), 1060 * kMs));
  EXPECT_TRUE(clocks.place("imu", stamp(1061 * kMs), 1061 * kMs));
}

TEST(Ros2Clocks, TheFramesOfPerduresOwnCameraAreTheClockAtOnce) {
  Clocks clocks(std::chrono::seconds(5));
  clocks.addInput("imu", true);
  clocks.observeCommon(fromNanoseconds(kWall), kMs);
  EXPECT_TRUE(clocks.place("imu", stampOf(kWall), 2 * kMs));
  EXPECT_EQ(reasonOf(clocks.place("imu", stampOf(12 * kSecond), 3 * kMs)), "stamp_elsewhere");
}

TEST(Ros2Clocks, RefusesStampsThatAreNone) {
  Clocks clocks = clocksOf(true);
  EXPECT_EQ(clocks.place("cam0", {0, 0}, 0).error().code, "stamp_missing");
  EXPECT_EQ(clocks.place("cam0", {-5, 0}, 0).error().code, "stamp_malformed");
  EXPECT_EQ(clocks.place("cam0", {5, 4'000'000'000U}, 0).error().code, "stamp_malformed");
}

TEST(Ros2Clocks, RefusesOldStampsButBeginsAnewWithADriverThatDoes) {
  Clocks clocks = clocksOf(true);
  settle(clocks, kSecond);
  const std::int64_t now = kSecond + kMs;
  EXPECT_EQ(reasonOf(clocks.place("cam0", stampOf(kWall + kSecond), now)), "stamp_not_newer");
  EXPECT_EQ(reasonOf(clocks.place("cam0", stampOf(kWall), now)), "stamp_not_newer");
  const auto loop = [](std::int64_t t) { return stampOf(kWall - 60 * kSecond + t); };
  for (std::int64_t t = kSecond; t < 2 * kSecond; t += 20 * kMs) {
    const bool taken = clocks.place("cam0", loop(t), t).has_value();
    EXPECT_EQ(taken, t > 1020 * kMs) << "a bag in a loop; " << t;
    EXPECT_EQ(clocks.place("imu", loop(t), t).has_value(), t > kSecond);
  }
}

/// The driver has its own clock, and messages are late by 1 to 20 ms. The smallest delays of both
/// inputs remain as error.
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
    if (i < 65) continue;  // two frames, then half a second
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
