#include "tools/calibrate/rig_check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "common/sim/dice.h"

namespace perdure::calibrate {
namespace {

using testing::HasSubstr;

/// vio's results for a correct rig: innovations with a χ² distribution and without a pattern.
RigCheck goodCheck(double pattern = 0.0) {
  RigCheck check;
  check.camera.width = 640, check.camera.height = 480;
  check.frames = 500, check.tracked = 490, check.believed = true;
  check.sigma << 5e-4, 5e-4, 5e-4, 2e-3, 2e-3, 2e-3, 1e-4;
  sim::Dice dice(9);
  for (int i = 0; i < 8000; ++i) {
    const Eigen::Vector2d noise(dice.normal(), dice.normal());
    vio::Innovation one;
    one.pixel = {dice.uniform(0, 640), dice.uniform(0, 480)};
    one.residual = 0.4 * noise + pattern * (one.pixel - Eigen::Vector2d(320, 240)) / 300.0;
    one.nis = noise.squaredNorm();
    one.rows = 2;
    one.used = one.nis < 5.99;
    check.innovations.push_back(one);
  }
  return check;
}

Judgement worst(const RigCheck& check) {
  const auto all = judgeRig(check);
  return *std::max_element(all.begin(), all.end(),
                           [](const auto& a, const auto& b) { return a.grade < b.grade; });
}

TEST(RigCheck, InnovationsAsBelievedHaveARatioOfOne) {
  EXPECT_NEAR(innovationRatio(goodCheck().innovations), 1.0, 0.05);
  RigCheck check = goodCheck();
  for (auto& i : check.innovations) i.nis *= 5.0;
  EXPECT_NEAR(innovationRatio(check.innovations), 5.0, 0.25);
  EXPECT_EQ(worst(check).grade, Grade::kBad);
  EXPECT_THAT(worst(check).text, HasSubstr("calibrate again"));
}

TEST(RigCheck, AGoodRigIsGood) {
  EXPECT_EQ(worst(goodCheck()).grade, Grade::kGood) << worst(goodCheck()).text;
}

TEST(RigCheck, APatternBelowTheNoiseNamesTheLens) {
  EXPECT_THAT(worst(goodCheck(0.15)).text, HasSubstr("focal length or distortion"));
}

TEST(RigCheck, ACameraThatMovedIsToldOnlyWhereVioIsSure) {
  RigCheck check = goodCheck();
  check.turned = {0.0, 0.03, 0.0};
  EXPECT_EQ(worst(check).grade, Grade::kBad);
  EXPECT_THAT(worst(check).text, HasSubstr("1.72°"));
  check.sigma.head<3>().setConstant(0.02);
  EXPECT_EQ(worst(check).grade, Grade::kGood) << worst(check).text;
}

// If vio's uncertainty would hide an error, the check must use more of the drive.
TEST(RigCheck, IsSurelyGoodWhereWhatIsBadWouldBeTold) {
  RigCheck check = goodCheck();
  EXPECT_TRUE(isSurelyGood(check));
  check.sigma.segment<3>(3).setConstant(0.006);
  EXPECT_FALSE(isSurelyGood(check)) << "10 mm of deviation in all";
  check = goodCheck();
  check.later_s = 0.004;
  EXPECT_FALSE(isSurelyGood(check)) << "it is doubtful";
  check = goodCheck();
  check.innovations.resize(400);
  EXPECT_FALSE(isSurelyGood(check)) << "too few innovations";
}

TEST(RigCheck, ATimeOffsetComesWithTheValueToSet) {
  RigCheck check = goodCheck();
  check.camera.time_offset_s = 0.004;
  check.later_s = 0.012;
  EXPECT_EQ(worst(check).grade, Grade::kBad);
  EXPECT_THAT(worst(check).text, HasSubstr("set time_offset_s to 0.0160"));
}

TEST(RigCheck, WhatIsOffAtOnceIsNoFix) {
  RigCheck check = goodCheck();
  check.turned = {0.0, 0.012, 0.0};
  check.later_s = 0.012;
  check.accel_bias_change = 0.3;
  EXPECT_EQ(worst(check).grade, Grade::kBad);
  EXPECT_THAT(worst(check).text, HasSubstr("order, signs and units of the IMU's columns"));
  for (const auto& one : judgeRig(check)) {
    EXPECT_THAT(one.text, testing::Not(HasSubstr("set time_offset_s")));
  }
}

TEST(RigCheck, WhereMuchContradictsNumbersAreNoFix) {
  RigCheck check = goodCheck();
  check.contradicted = 150;
  check.turned = {0.0, 0.085, 0.0};
  EXPECT_THAT(worst(check).text, HasSubstr("correct nothing by the numbers below before"));
  for (const auto& one : judgeRig(check)) {
    EXPECT_THAT(one.text, testing::Not(HasSubstr("calibrate again")));
  }
}

TEST(RigCheck, ASecondCameraAloneThatContradictsIsNamed) {
  RigCheck both = goodCheck(), alone = goodCheck();
  EXPECT_FALSE(isSecondSuspect(both));
  both.contradicted = 300;
  EXPECT_TRUE(isSecondSuspect(both));
  ASSERT_EQ(judgeSecond(both, alone).size(), 1U);
  EXPECT_THAT(judgeSecond(both, alone)[0].text, HasSubstr("the second camera is wrong"));
  alone.contradicted = 300;
  EXPECT_TRUE(judgeSecond(both, alone).empty());
}

TEST(RigCheck, ABiasThatWandersIsNotGravity) {
  RigCheck check = goodCheck();
  check.accel_bias_change = 0.8;
  EXPECT_EQ(worst(check).grade, Grade::kBad);
  EXPECT_THAT(worst(check).text, HasSubstr("gravity"));
}

TEST(RigCheck, ImagesThatContradictTheImuAreNotTooFew) {
  RigCheck check = goodCheck();
  check.innovations.resize(100);  // nearly all innovations were rejected
  check.contradicted = 200;
  EXPECT_EQ(worst(check).grade, Grade::kBad);
  EXPECT_THAT(worst(check).text, HasSubstr("T_BS"));
  for (const auto& one : judgeRig(check)) {
    EXPECT_THAT(one.text, testing::Not(HasSubstr("record a minute")));
  }
  check.contradicted = 10;
  EXPECT_THAT(worst(check).text, HasSubstr("record a minute"));
}

TEST(RigCheck, AHoleOfTheRecordingIsNoFaultOfTheRig) {
  RigCheck check = goodCheck();
  check.resets = check.holes = 1;
  EXPECT_EQ(worst(check).grade, Grade::kBad);
  EXPECT_THAT(worst(check).text, HasSubstr("stamps jump, or samples are missing, 1 times"));
  for (const auto& one : judgeRig(check)) {
    EXPECT_THAT(one.text, testing::Not(HasSubstr("calibrate anew")));
  }
}

TEST(RigCheck, ASpeedThatIsNearlyAlwaysRefusedIsTold) {
  RigCheck check = goodCheck();
  check.speed_refused = 400;
  EXPECT_EQ(worst(check).grade, Grade::kBad);
  EXPECT_THAT(worst(check).text, HasSubstr("see its unit (m/s)"));
  check.speed_refused = 50;
  EXPECT_EQ(worst(check).grade, Grade::kGood);
}

TEST(RigCheck, TooLittleToJudgeBySaysWhatToRecord) {
  RigCheck check = goodCheck();
  check.innovations.resize(100);
  EXPECT_EQ(worst(check).grade, Grade::kDoubtful);
  EXPECT_THAT(worst(check).text, HasSubstr("record a minute of motion"));
  check.believed = false;
  check.tracked = 0;
  EXPECT_EQ(worst(check).grade, Grade::kBad);
  check.resets = 3;
  EXPECT_THAT(judgeRig(check)[1].text, HasSubstr("lost its way 3 times"));
}

}  // namespace
}  // namespace perdure::calibrate
