#include "services/capture/node.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <deque>

namespace perdure::capture {
namespace {

using ::testing::ElementsAre;

constexpr std::int64_t kMs = 1'000'000;
constexpr std::int64_t kOrigin = 5'000 * kMs;  // sensor time of the first frame

/// A drive with a frame every 100 ms, each followed by a sample 10 ms later; a node that plays it;
/// and a clock that the test sets.
class NodeTest : public ::testing::Test {
 protected:
  NodeTest() {
    for (std::uint64_t i = 0; i < 10; ++i) {
      Frame frame;
      frame.stamp.sequence = i;
      frame.stamp.time = fromNanoseconds(kOrigin + static_cast<std::int64_t>(i) * 100 * kMs);
      frame.camera = "cam0";
      drive_.emplace_back(frame);
      ImuSample imu;
      imu.sequence = i;
      imu.time = frame.stamp.time + Duration(10 * kMs);
      drive_.emplace_back(imu);
    }
  }
  Outputs outputs() {
    return {[this](const ImuSample& s) { samples_.push_back(s.sequence); },
            [](const SpeedSample&) {},
            [this](const Frame& f) {
              frames_.push_back(f.stamp.sequence);
              captured_ns_.push_back(f.stamp.captured_ns);
            }};
  }
  /// Ticks at `now` until nothing is due; returns the node's next waiting time.
  Duration run(Node& node, std::int64_t now) {
    while (true) {
      if (node.wants() && !drive_.empty()) {
        node.offer(drive_.front());
        drive_.pop_front();
      } else if (node.wants()) {
        node.end();
      }
      const Duration wait = node.tick(now);
      if (wait > Duration{0}) return wait;
    }
  }
  static FrameStamp stamp(std::uint64_t sequence) {
    FrameStamp s;
    s.sequence = sequence;
    return s;
  }

  Config config_;
  std::deque<replay::Message> drive_;
  std::vector<std::uint64_t> frames_, samples_;
  std::vector<std::int64_t> captured_ns_;
};

TEST_F(NodeTest, GivesEachMessageAtItsTimeOfTheDrive) {
  Node node(config_, Duration(100 * kMs), std::nullopt, outputs());
  const std::int64_t t0 = 77 * kMs;
  EXPECT_EQ(run(node, t0), Duration(10 * kMs));
  EXPECT_THAT(frames_, ElementsAre(0));
  EXPECT_TRUE(samples_.empty());
  EXPECT_EQ(run(node, t0 + 10 * kMs), Duration(90 * kMs));
  EXPECT_THAT(samples_, ElementsAre(0));
  run(node, t0 + 100 * kMs);
  EXPECT_THAT(frames_, ElementsAre(0, 1));
  EXPECT_THAT(captured_ns_, ElementsAre(t0, t0 + 100 * kMs));
  EXPECT_TRUE(node.reasons().all().empty());
}

TEST_F(NodeTest, RateShortensTheTimesBetweenMessages) {
  config_.pace.rate = 4;
  Node node(config_, Duration(100 * kMs), std::nullopt, outputs());
  run(node, 0);
  EXPECT_EQ(run(node, 5 * kMs), Duration(20 * kMs));
  run(node, 50 * kMs);
  EXPECT_THAT(frames_, ElementsAre(0, 1, 2));
}

TEST_F(NodeTest, CountsWhatItGivesLate) {
  Node node(config_, Duration(100 * kMs), std::nullopt, outputs());
  run(node, 0);
  run(node, 450 * kMs);
  EXPECT_THAT(frames_, ElementsAre(0, 1, 2, 3, 4)) << "late, but not lost";
  EXPECT_EQ(node.reasons().of("late"), 3u) << "frames 1, 2, 3 are more than 100 ms late";
}

TEST_F(NodeTest, EndsAfterTheLastMessage) {
  Node node(config_, Duration(100 * kMs), std::nullopt, outputs());
  run(node, 0);
  EXPECT_FALSE(node.finished());
  EXPECT_EQ(run(node, 910 * kMs), Duration::max());
  EXPECT_TRUE(node.finished());
  EXPECT_EQ(node.framesGiven(), 10u);
  EXPECT_EQ(node.state().next_sequence, 10u);
}

TEST_F(NodeTest, CarriesOnAfterARestartWhereTheClockOfTheRunIs) {
  RunState before;
  before.start_ns = 1000 * kMs;
  before.origin_ns = kOrigin;
  before.last_ns = kOrigin + 210 * kMs;  // frames 0 to 2 and their samples have been sent
  before.next_sequence = 3;
  drive_.erase(drive_.begin(), drive_.begin() + 5);  // the loader seeks to frame 3
  Node node(config_, Duration(100 * kMs), before, outputs());
  EXPECT_EQ(run(node, 1560 * kMs), Duration(40 * kMs));
  EXPECT_THAT(frames_, ElementsAre(5)) << "frames 3 and 4 went by, 5 is 60 ms late, 6 is to come";
  EXPECT_THAT(samples_, ElementsAre(3, 4, 5)) << "sample 2 was given before, 3 and 4 come late";
  EXPECT_EQ(node.reasons().of("missed_while_away"), 2u);
}

TEST_F(NodeTest, AnInstantRestartLosesAndDoublesNothing) {
  const std::deque<replay::Message> whole = drive_;
  Node first(config_, Duration(100 * kMs), std::nullopt, outputs());
  run(first, 0);
  run(first, 320 * kMs);
  const auto state = runStateFrom(toText(first.state()));
  ASSERT_TRUE(state);
  // the drive begins with the sample of frame 3, as after a seek to 4
  drive_.assign(whole.begin() + 7, whole.end());
  Node second(config_, Duration(100 * kMs), state, outputs());
  run(second, 320 * kMs);
  run(second, 910 * kMs);
  EXPECT_THAT(frames_, ElementsAre(0, 1, 2, 3, 4, 5, 6, 7, 8, 9));
  EXPECT_THAT(samples_, ElementsAre(0, 1, 2, 3, 4, 5, 6, 7, 8, 9));
}

TEST_F(NodeTest, FollowSendsTheNextFrameOnlyWhenAllHaveAnswered) {
  config_.pace.mode = "follow";
  Node node(config_, Duration(100 * kMs), std::nullopt, outputs());
  node.expect("odometry");
  node.expect("detections");
  run(node, 0);
  EXPECT_THAT(frames_, ElementsAre(0));
  EXPECT_THAT(samples_, ElementsAre(0)) << "samples up to the next frame are needed to answer";
  node.onAnswer("odometry", stamp(0));
  run(node, 1 * kMs);
  EXPECT_THAT(frames_, ElementsAre(0));
  EXPECT_EQ(node.state().next_sequence, 0u) << "frame 0 is not credited yet";
  node.onAnswer("detections", stamp(0));
  EXPECT_EQ(node.state().next_sequence, 1u);
  run(node, 2 * kMs);
  EXPECT_THAT(frames_, ElementsAre(0, 1));
}

TEST_F(NodeTest, FollowGoesOnWithoutAnAnswerAfterItsTimeAndCountsIt) {
  config_.pace.mode = "follow";
  config_.pace.timeout_s = 0.5;
  Node node(config_, Duration(100 * kMs), std::nullopt, outputs());
  node.expect("odometry");
  EXPECT_EQ(run(node, 0), Duration(500 * kMs));
  EXPECT_EQ(run(node, 499 * kMs), Duration(1 * kMs));
  EXPECT_THAT(frames_, ElementsAre(0));
  run(node, 500 * kMs);
  EXPECT_THAT(frames_, ElementsAre(0, 1));
  EXPECT_EQ(node.reasons().of("answer_timeout"), 1u);
}

TEST_F(NodeTest, FollowResumesAtTheFirstFrameThatWasNotCredited) {
  config_.pace.mode = "follow";
  RunState before;
  before.origin_ns = kOrigin;
  before.last_ns = kOrigin + 310 * kMs;
  before.next_sequence = 3;  // frame 3 was sent but not answered
  drive_.erase(drive_.begin(), drive_.begin() + 5);
  Node node(config_, Duration(100 * kMs), before, outputs());
  node.expect("odometry");
  run(node, 9000 * kMs);
  EXPECT_THAT(frames_, ElementsAre(3));
  EXPECT_EQ(node.reasons().of("missed_while_away"), 0u);
}

TEST_F(NodeTest, AWindowOfTwoLetsTwoFramesBeOnTheWay) {
  config_.pace.mode = "follow";
  config_.pace.window = 2;
  Node node(config_, Duration(100 * kMs), std::nullopt, outputs());
  node.expect("odometry");
  run(node, 0);
  EXPECT_THAT(frames_, ElementsAre(0, 1));
  node.onAnswer("odometry", stamp(1));  // answers frame 0 as well
  run(node, 0);
  EXPECT_THAT(frames_, ElementsAre(0, 1, 2, 3));
}

TEST_F(NodeTest, AnswersToFramesOfTheFutureAreNotBelieved) {
  config_.pace.mode = "follow";
  Node node(config_, Duration(100 * kMs), std::nullopt, outputs());
  node.expect("odometry");
  run(node, 0);
  node.onAnswer("odometry", stamp(UINT64_MAX));
  node.onAnswer("somebody", stamp(0));
  run(node, 0);
  EXPECT_THAT(frames_, ElementsAre(0));
}

TEST(RunState, ComesBackAsItWasAndRefusesRubbish) {
  RunState s;
  s.drive = "abc";
  s.boot = "b-1";
  s.start_ns = -5;
  s.origin_ns = 1403715273262142976;
  s.last_ns = 3;
  s.next_sequence = 17;
  s.finished = true;
  const std::string text = toText(s);
  const auto back = runStateFrom(text);
  ASSERT_TRUE(back);
  EXPECT_EQ(toText(*back), text);
  EXPECT_EQ(back->next_sequence, 17u);
  EXPECT_TRUE(back->finished);
  for (std::size_t n = 0; n + 1 < text.size(); ++n) {
    EXPECT_FALSE(runStateFrom(text.substr(0, n))) << "cut at " << n;
  }
}

}  // namespace
}  // namespace perdure::capture
