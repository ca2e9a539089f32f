#include "tools/outputs/run_doubts.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace perdure::tools {
namespace {

using testing::AllOf;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using Grade = replay::DataFinding::Grade;

std::vector<std::string> sentences(const RunFacts& facts) { return toJson(doubtsOfRun(facts)); }

std::vector<std::string> doubtsAt(const char* code, std::uint64_t times) {
  ReasonCounts vio;
  vio.add(code, times);
  return sentences({.vio = vio, .frames = 240});
}

TEST(Doubts, AGoodRunHasNone) {
  EXPECT_THAT(sentences({.frames = 240, .boxes = 9, .objects = 2}), IsEmpty());
  EXPECT_THAT(sentences({}), IsEmpty());
  EXPECT_THAT(doubtsAt("msckf_gated", 900), IsEmpty());
  EXPECT_THAT(doubtsAt("speed_gated", 20), IsEmpty());
}

TEST(Doubts, ContradictionsOfATenthOfTheRunAreTold) {
  EXPECT_THAT(doubtsAt("images_contradict_imu", 24),
              ElementsAre(AllOf(HasSubstr("at 24 of 240 frames"), HasSubstr("axes, signs"))));
  EXPECT_THAT(doubtsAt("images_contradict_imu", 12), IsEmpty());
  EXPECT_THAT(doubtsAt("poses_contradict_images", 24), ElementsAre(HasSubstr("T_BW for T_WB")));
  EXPECT_THAT(doubtsAt("points_too_far", 24), ElementsAre(HasSubstr("in metres")));
}

TEST(Doubts, AnUncertainPositionIsTold) {
  EXPECT_THAT(doubtsAt("position_uncertain", 24), ElementsAre(HasSubstr("turn less on the spot")));
  EXPECT_THAT(doubtsAt("position_uncertain", 12), IsEmpty());
}

TEST(Doubts, ASpeedThatIsRefusedIsTold) {
  EXPECT_THAT(doubtsAt("speed_gated", 200), ElementsAre(HasSubstr("its unit (m/s)")));
}

TEST(Doubts, ImagesThatCannotBeReadAreTold) {
  ReasonCounts capture;
  capture.add("image_truncated", 9);
  EXPECT_THAT(sentences({.frames = 231, .capture = capture}), IsEmpty());
  capture.add("frame_stray", 9);
  EXPECT_THAT(sentences({.frames = 222, .capture = capture}),
              ElementsAre(HasSubstr("18 of 240 images are missing or cannot be read")));
}

TEST(Doubts, TwoFramesOfReferenceAreTold) {
  EXPECT_THAT(doubtsAt("reset", 1), ElementsAre(HasSubstr("not in one frame of reference")));
}

TEST(Doubts, TheLastLineNamesWhatWouldElseBeSilent) {
  EXPECT_EQ(endOfLine(doubtsOfRun({.frames = 240})), "");
  EXPECT_EQ(endOfLine(doubtsOfRun({.frames = 240, .poses = 120})), "");
  EXPECT_EQ(endOfLine(doubtsOfRun({.frames = 240, .poses = 1})),
            " | WARNING: only 1 of 240 frames have a pose");
  EXPECT_THAT(doubtsAt("frame_without_update", 24), IsEmpty());
  ReasonCounts vio;
  vio.add("frame_without_update", 90);
  RunFacts facts{.vio = vio, .frames = 240, .boxes = 70};
  facts.findings.push_back({Grade::kCause, "clock_set", "set back by 2 s"});
  facts.findings.push_back({Grade::kNote, "camera_unknown", "has no effect"});
  EXPECT_EQ(endOfLine(doubtsOfRun(facts)),
            " | WARNING: clock_set; no image point could be used at 90 of 240 frames; the "
            "map is empty although there are 70 boxes");
  EXPECT_THAT(sentences(facts), Contains(HasSubstr("set back by 2 s")));
}

TEST(Doubts, PosesOfAPartOfTheDriveAreTold) {
  EXPECT_THAT(sentences({.frames = 240, .without_pose = 10}), IsEmpty());
  EXPECT_THAT(sentences({.frames = 240, .without_pose = 30}),
              ElementsAre(HasSubstr("30 of 240 frames have no pose")));
  EXPECT_THAT(sentences({.frames = 240, .without_pose = 234}),
              ElementsAre(HasSubstr("234 of 240 frames have no pose")));
}

TEST(RunDoubts, ACauseInTheDataComesBeforeItsConsequences) {
  RunFacts facts{.frames = 100};
  facts.vio.add("images_contradict_imu", 60);
  EXPECT_THAT(doubtsOfRun(facts)[0].fix, testing::StartsWith("T_BS"));
  facts.findings = {{Grade::kCause, "clock_step", "stamps jump"}};
  const auto doubts = doubtsOfRun(facts);
  ASSERT_EQ(doubts.size(), 2U);
  EXPECT_EQ(doubts[0].fix, "stamps jump");
  EXPECT_THAT(doubts[1].fix, testing::StartsWith("see the cause above; otherwise T_BS"));
}

}  // namespace
}  // namespace perdure::tools
