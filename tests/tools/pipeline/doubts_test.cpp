#include "tools/pipeline/doubts.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace perdure::tools {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

std::vector<std::string> doubtsAt(const char* code, std::uint64_t times) {
  ReasonCounts vio;
  vio.add(code, times);
  return doubtsOfRun(vio, 240, 0);
}

TEST(Doubts, AGoodRunHasNone) {
  EXPECT_THAT(doubtsOfRun({}, 240, 0), IsEmpty());
  EXPECT_THAT(doubtsOfRun({}, 0, 0), IsEmpty());
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
  EXPECT_THAT(doubtsAt("position_uncertain", 24),
              ElementsAre(HasSubstr("no object was confirmed")));
  EXPECT_THAT(doubtsAt("position_uncertain", 12), IsEmpty());
}

TEST(Doubts, ASpeedThatIsRefusedIsTold) {
  EXPECT_THAT(doubtsAt("speed_gated", 200), ElementsAre(HasSubstr("its unit (m/s)")));
}

TEST(Doubts, TwoFramesOfReferenceAreTold) {
  EXPECT_THAT(doubtsAt("reset", 1), ElementsAre(HasSubstr("not in one frame of reference")));
}

TEST(Doubts, ARigThatTheRunContradictsIsTold) {
  calibrate::RigCheck check;
  check.believed = true;
  check.camera.width = 640, check.camera.height = 480;
  vio::Innovation one;
  one.used = true, one.rows = 2, one.nis = 1.4;
  check.innovations.assign(600, one);
  EXPECT_THAT(doubtsOfRig(check), IsEmpty());
  check.turned = {0.3, 0, 0};
  EXPECT_THAT(doubtsOfRig(check), ElementsAre(AllOf(HasSubstr("does not fit the run"),
                                                    HasSubstr("the camera's rotation 17.19°"))));
  check.innovations.clear();  // another check reports a run that did not start
  EXPECT_THAT(doubtsOfRig(check), IsEmpty());
}

TEST(Doubts, PosesOfAPartOfTheDriveAreTold) {
  EXPECT_THAT(doubtsOfRun({}, 240, 10), IsEmpty());
  EXPECT_THAT(doubtsOfRun({}, 240, 234), ElementsAre(HasSubstr("234 of 240 frames have no pose")));
}

}  // namespace
}  // namespace perdure::tools
