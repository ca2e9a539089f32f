#include "services/capture/live/frame_count.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <vector>

#include "tests/services/capture/live/times.h"

namespace perdure::capture {
namespace {

using ::testing::HasSubstr;

TEST(FrameNumbers, GoOnWhenTheCameraIsOpenedAgain) {
  FrameNumbers numbers;
  for (std::uint32_t i = 0; i < 5; ++i) EXPECT_EQ(numbers.of(i), i);
  numbers.reopened();
  for (std::uint32_t i = 0; i < 5; ++i) {
    EXPECT_EQ(numbers.of(i), 5 + i);
    EXPECT_EQ(numbers.lost(), 0U);
  }
}

TEST(FrameNumbers, LeaveAGapForWhatTheDriverLost) {
  FrameNumbers numbers;
  (void)numbers.of(0);
  EXPECT_EQ(numbers.of(3), 3U);
  EXPECT_EQ(numbers.lost(), 2U);
  EXPECT_EQ(numbers.of(4), 4U);
  EXPECT_EQ(numbers.lost(), 0U);
}

TEST(FrameNumbers, GoOnWhereTheDriversNumberWrapsOrGoesBack) {
  FrameNumbers numbers;
  (void)numbers.of(0xfffffffe);
  EXPECT_EQ(numbers.of(1), 3U);
  EXPECT_EQ(numbers.lost(), 2U);
  EXPECT_EQ(numbers.of(1), 4U);
  EXPECT_EQ(numbers.lost(), 0U);
  EXPECT_EQ(numbers.of(0), 5U);
  EXPECT_EQ(numbers.lost(), 0U);
}

/// Adds the frames of `seconds` at this rate.
void run(RateWatch& watch, double hz, double seconds) {
  for (int i = 0; i <= static_cast<int>(seconds * hz); ++i) {
    watch.frame(static_cast<std::uint64_t>(i), static_cast<std::int64_t>(kSecond / hz * i));
  }
}

TEST(SequenceWatch, SeesThatImagesAreMissingBeforeOne) {
  SequenceWatch watch;
  EXPECT_FALSE(watch.skips(0));
  EXPECT_TRUE(watch.skips(3)) << "the first ones of an opening";
  watch.seen(827);
  EXPECT_FALSE(watch.skips(828));
  EXPECT_TRUE(watch.skips(836));
  watch.seen(0xffffffff);
  EXPECT_FALSE(watch.skips(0));
}

TEST(SequenceWatch, OrdersNumbersThatGoRound) {
  std::vector<std::uint32_t> held = {2, 0xfffffffe, 1, 0xffffffff, 0};
  std::sort(held.begin(), held.end(), isEarlier);
  EXPECT_EQ(held, (std::vector<std::uint32_t>{0xfffffffe, 0xffffffff, 0, 1, 2}));
  EXPECT_FALSE(isEarlier(7, 7));
}

TEST(RateWatch, SaysWhatTheCameraGivesWhereThatIsNotWhatIsAsked) {
  RateWatch watch(20.0);
  run(watch, 30.0, 4.0);
  EXPECT_EQ(watch.note(), "") << "it has seen too little";
  watch.reopened();
  run(watch, 30.0, 6.0);
  EXPECT_THAT(watch.note(), HasSubstr("30 images a second where 20 are asked for"));
  EXPECT_THAT(watch.note(), HasSubstr("camera.rate_hz"));
  watch.reopened();
  EXPECT_EQ(watch.note(), "");
}

TEST(RateWatch, TakesARateThatIsNearlyAskedForAsThat) {
  RateWatch watch(20.0);
  run(watch, 21.0, 6.0);
  EXPECT_EQ(watch.note(), "");
}

TEST(RateWatch, SaysItOnceAndNotAnewWithEachChange) {
  RateWatch watch(20.0);
  run(watch, 30.0, 6.0);
  const std::string said = watch.note();
  for (int i = 0; i < 100; ++i) {
    watch.frame(static_cast<std::uint64_t>(200 + i), 10 * kSecond + i * kSecond / 7);
  }
  EXPECT_EQ(watch.note(), said);
}

TEST(RateWatch, CountsFramesThatWereLostOnTheWayAsGiven) {
  RateWatch watch(20.0);
  for (int i = 0; i <= 120; i += 2) {
    watch.frame(static_cast<std::uint64_t>(i), kSecond / 20 * i);
  }
  EXPECT_EQ(watch.note(), "");
}

}  // namespace
}  // namespace perdure::capture
