#include "services/capture/live/clocks.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/services/capture/live/times.h"

namespace perdure::capture {
namespace {

TEST(HostClock, GoesAsTheSystemsClocksDo) {
  const HostClock clock;
  const std::int64_t now = HostClock::nowNs();
  EXPECT_LT(
      std::abs(toSeconds(Duration(toNanoseconds(clock.at(now)) -
                                  std::chrono::system_clock::now().time_since_epoch().count()))),
      0.05);
  EXPECT_EQ(clock.at(now + kSecond) - clock.at(now), std::chrono::seconds(1));
  EXPECT_GE(HostClock::monotonicToBootNs(), -kMs);
}

TEST(ClockDifference, IsNotThatOfAThreadInterruptedBetweenTheClocks) {
  std::int64_t time = 0;
  int readings = 0;
  const auto ours = [&] { return time += ++readings < 8 ? 3 * kMs : 300; };
  const auto theirs = [&] { return kSecond + (time += 300); };
  EXPECT_NEAR(static_cast<double>(clockDifference(ours, theirs)), 1e9, 300.0);
}

TEST(ClockDifference, TakesTheBestWhereNoneIsGood) {
  std::int64_t time = 0;
  int readings = 0;
  const auto ours = [&] { return time += ++readings == 4 ? 20'000 : 3 * kMs; };
  const auto theirs = [&] { return kSecond + time; };
  EXPECT_NEAR(static_cast<double>(clockDifference(ours, theirs)), 1e9, 20'000.0);
}

TEST(CameraStamp, IsOnBootTimeWhicheverOfTheClocksTheDriverStampsBy) {
  const std::int64_t monotonic = 5000 * kSecond, boot = monotonic + 1000 * kSecond;
  EXPECT_EQ(cameraStampToBoot(monotonic - 40 * kMs, monotonic, boot), boot - 40 * kMs);
  EXPECT_EQ(cameraStampToBoot(boot - 40 * kMs, monotonic, boot), boot - 40 * kMs);
  EXPECT_EQ(cameraStampToBoot(monotonic + kMs, monotonic, boot), boot + kMs)
      << "a driver that predicts";
  EXPECT_EQ(cameraStampToBoot(monotonic - kMs, monotonic, monotonic), monotonic - kMs)
      << "never suspended";
}

TEST(CameraStamp, IsTheMiddleOfTheMiddleRowsExposure) {
  EXPECT_EQ(middleOfExposure(kSecond, 10'000, 0.02), kSecond + 5 * kMs + 10 * kMs);
}

/// A clock that is one hour ahead and 100 ppm fast, observed through messages with a delay of 2 ms
/// or more.
struct Elsewhere {
  ClockMap map;
  std::mt19937 random{7};
  std::int64_t ahead = 3600 * kSecond;
  double fast = 1e-4;

  std::int64_t theirs(std::int64_t ours) const {
    return ours + ahead + std::llround(fast * static_cast<double>(ours));
  }
  void run(std::int64_t from, std::int64_t until) {
    std::exponential_distribution<double> late(1.0 / 3.0);  // ms above the minimum
    for (std::int64_t t = from; t < until; t += 5 * kMs) {
      map.observe(theirs(t), t + 2 * kMs + static_cast<std::int64_t>(kMs * late(random)));
    }
  }
  double errorMs(std::int64_t t) const {
    return 1e-6 * static_cast<double>(*map.toOurs(theirs(t)) - t);
  }
};

TEST(ClockMap, IsRightToTheLeastDelayWhateverTheJitterAndTheDrift) {
  Elsewhere e;
  e.run(0, kSecond / 5);
  EXPECT_FALSE(e.map.toOurs(0)) << "it has seen too little";
  e.run(kSecond / 5, 60 * kSecond);
  for (int i = 0; i < 100; ++i) {
    const std::int64_t t = (60 + i) * kSecond;
    e.run(t, t + kSecond);
    EXPECT_NEAR(e.errorMs(t + kSecond), 2.0, 1.0) << i;
  }
  EXPECT_EQ(e.map.jumps(), 0U);
}

TEST(ClockMap, KeepsTheDistancesBetweenStamps) {
  Elsewhere e;
  e.run(0, 10 * kSecond);
  std::int64_t before = *e.map.toOurs(e.theirs(10 * kSecond));
  for (std::int64_t t = 10 * kSecond + 5 * kMs; t < 30 * kSecond; t += 5 * kMs) {
    e.run(t, t + 5 * kMs);
    const std::int64_t now = *e.map.toOurs(e.theirs(t));
    EXPECT_NEAR(static_cast<double>(now - before), 5e6, 3e4);
    before = now;
  }
}

TEST(ClockMap, FollowsAClockThatIsSet) {
  for (const std::int64_t step : {kSecond, -kSecond}) {
    Elsewhere e;
    e.run(0, 20 * kSecond);
    e.ahead += step;
    e.run(20 * kSecond, 32 * kSecond);
    EXPECT_NEAR(e.errorMs(32 * kSecond), 2.0, 1.0);
    EXPECT_EQ(e.map.jumps(), 1U);
  }
}

}  // namespace
}  // namespace perdure::capture
