#include "services/vio/waiting_frames.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/vio/core/start/speed_history.h"

namespace perdure::vio {
namespace {

using ::testing::HasSubstr;

constexpr std::int64_t kMs = 1'000'000;

Frame frameAt(std::int64_t ms) {
  Frame frame;
  frame.stamp.time = fromNanoseconds(ms * kMs);
  return frame;
}

std::string codeOf(const Result<void>& result) { return result ? "" : result.error().code; }

TEST(WaitingFrames, AreTakenInOrderWithTheirPartners) {
  WaitingFrames waiting(0.01);
  EXPECT_EQ(codeOf(waiting.addSecond(frameAt(104))), "");  // this frame arrives before its partner
  EXPECT_EQ(codeOf(waiting.addFirst(frameAt(100))), "");
  EXPECT_EQ(codeOf(waiting.addFirst(frameAt(200))), "");
  EXPECT_EQ(codeOf(waiting.addFirst(frameAt(150))), "frame_reordered");
  EXPECT_EQ(codeOf(waiting.addFirst(frameAt(150))), "frame_duplicate");
  EXPECT_EQ(codeOf(waiting.addSecond(frameAt(191))), "");
  ASSERT_EQ(waiting.size(), 3u);
  const FramePair first = waiting.take(), middle = waiting.take(), last = waiting.take();
  EXPECT_EQ(first.first.stamp.time, frameAt(100).stamp.time);
  ASSERT_TRUE(first.second);
  EXPECT_EQ(first.second->stamp.time, frameAt(104).stamp.time);
  EXPECT_FALSE(middle.second);
  ASSERT_TRUE(last.second);
  EXPECT_EQ(last.second->stamp.time, frameAt(191).stamp.time);
  EXPECT_TRUE(waiting.empty());
}

TEST(WaitingFrames, ALaterFrameSaysThatNoPartnerWillCome) {
  WaitingFrames waiting(0.01);
  EXPECT_TRUE(waiting.addFirst(frameAt(100)));
  EXPECT_TRUE(waiting.frontMayBePaired());
  EXPECT_TRUE(waiting.addFirst(frameAt(150)));
  EXPECT_TRUE(waiting.frontMayBePaired());
  EXPECT_TRUE(waiting.addSecond(frameAt(150)));
  EXPECT_FALSE(waiting.frontMayBePaired()) << "the next one has its own";
  WaitingFrames alone(0.01);
  EXPECT_TRUE(alone.addFirst(frameAt(100)));
  EXPECT_TRUE(alone.addSecond(frameAt(115)));
  EXPECT_FALSE(alone.frontMayBePaired()) << "the second camera is past it";
}

TEST(WaitingFrames, SecondsWithoutPartnersDoNotPileUp) {
  WaitingFrames waiting(0.01);
  for (int i = 0; i < 4; ++i) EXPECT_TRUE(waiting.addSecond(frameAt(100 * i)));
  EXPECT_EQ(codeOf(waiting.addSecond(frameAt(400))), "stereo_unpaired");
  EXPECT_TRUE(waiting.addFirst(frameAt(0)));
  EXPECT_FALSE(waiting.take().second) << "given up";
  EXPECT_TRUE(waiting.addFirst(frameAt(400)));
  EXPECT_TRUE(waiting.take().second);
}

TEST(WaitingFrames, FramesOfAnEarlierRunAreGivenUp) {
  WaitingFrames waiting(0.01);
  EXPECT_TRUE(waiting.addSecond(frameAt(5000)));
  EXPECT_TRUE(waiting.addFirst(frameAt(5100)));
  EXPECT_EQ(codeOf(waiting.addFirst(frameAt(1000))), "frame_of_earlier_run");
  EXPECT_EQ(codeOf(waiting.addFirst(frameAt(1050))), "");
  EXPECT_EQ(waiting.size(), 2u);
  EXPECT_TRUE(waiting.addSecond(frameAt(900)));
  EXPECT_TRUE(waiting.frontMayBePaired()) << "the second camera's old image says nothing";
  EXPECT_TRUE(waiting.addSecond(frameAt(1000)));
  EXPECT_TRUE(waiting.front().second);
}

/// Adds frames of the first camera until the second one counts as missing.
void goAlone(WaitingFrames& waiting, int frames) {
  for (int i = 0; i < frames; ++i) {
    EXPECT_TRUE(waiting.addFirst(frameAt(50 * i)));
    waiting.take();
  }
}

TEST(WaitingFrames, ACameraThatIsAbsentIsNotAwaitedUntilItIsBack) {
  WaitingFrames waiting(0.01);
  goAlone(waiting, 9);
  EXPECT_TRUE(waiting.addFirst(frameAt(450)));
  EXPECT_TRUE(waiting.frontMayBePaired());
  EXPECT_EQ(waiting.whyAlone(), "");
  waiting.take();
  EXPECT_THAT(waiting.whyAlone(), HasSubstr("none comes"));
  EXPECT_TRUE(waiting.addFirst(frameAt(500)));
  EXPECT_FALSE(waiting.frontMayBePaired());
  waiting.take();
  EXPECT_EQ(codeOf(waiting.addSecond(frameAt(503))), "frame_late");
  EXPECT_TRUE(waiting.addFirst(frameAt(550)));
  EXPECT_TRUE(waiting.frontMayBePaired()) << "it is back";
  EXPECT_TRUE(waiting.addSecond(frameAt(553)));
  EXPECT_TRUE(waiting.take().second);
  EXPECT_EQ(waiting.whyAlone(), "");
}

TEST(WaitingFrames, TellWhyNoPartnerFits) {
  WaitingFrames late(0.01);
  goAlone(late, 12);
  EXPECT_EQ(codeOf(late.addSecond(frameAt(100))), "frame_late");
  EXPECT_THAT(late.whyAlone(), HasSubstr("too late"));
  WaitingFrames apart(0.01);
  for (int i = 0; i < 12; ++i) {
    (void)apart.addFirst(frameAt(50 * i));
    (void)apart.addSecond(frameAt(50 * i + 25));
    apart.take();
  }
  EXPECT_THAT(apart.whyAlone(), HasSubstr("stereo.pair_tolerance"));
  EXPECT_TRUE(apart.addFirst(frameAt(1000)));
  EXPECT_FALSE(apart.frontMayBePaired()) << "stamps that never fit are not awaited";
  WaitingFrames small(0.01);
  goAlone(small, 10);
  small.refuseSecond("frames of cam1 are small");
  EXPECT_THAT(small.whyAlone(), HasSubstr("cam1 are small"));
}

TEST(SpeedHistory, InterpolatesAndIsLessSureFurtherAway) {
  const auto ms = [](std::int64_t t) { return fromNanoseconds(t * kMs); };
  SpeedHistory speeds(0.15);
  EXPECT_FALSE(speeds.at(ms(0)));
  EXPECT_EQ(codeOf(speeds.add({0, 0, ms(100), 4.0, 0.1})), "");
  EXPECT_EQ(codeOf(speeds.add({0, 0, ms(200), 6.0, 0.2})), "");
  EXPECT_EQ(codeOf(speeds.add({0, 0, ms(200), 6.0, 0.2})), "speed_out_of_order");
  EXPECT_EQ(codeOf(speeds.add({0, 0, ms(300), NAN, 0.2})), "speed_not_finite");
  EXPECT_EQ(codeOf(speeds.add({0, 0, ms(300), 1.0, 0.0})), "speed_not_finite");
  ASSERT_TRUE(speeds.at(ms(125)));
  EXPECT_NEAR(speeds.at(ms(125))->speed, 4.5, 1e-9);
  EXPECT_NEAR(speeds.at(ms(125))->sigma, 0.2, 1e-9);
  ASSERT_TRUE(speeds.at(ms(300)));
  EXPECT_NEAR(speeds.at(ms(300))->speed, 6.0, 1e-9);
  EXPECT_NEAR(speeds.at(ms(300))->sigma, 0.4, 1e-9);
  EXPECT_FALSE(speeds.at(ms(360)));
  EXPECT_TRUE(speeds.reaches(ms(200)));
  EXPECT_FALSE(speeds.reaches(ms(201)));
}

}  // namespace
}  // namespace perdure::vio
