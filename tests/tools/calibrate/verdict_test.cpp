#include "tools/calibrate/verdict.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "common/sim/dice.h"

namespace perdure::calibrate {
namespace {

using testing::HasSubstr;

CameraCalibration camera640() {
  CameraCalibration camera;
  camera.name = "cam0";
  camera.width = 640, camera.height = 480;
  camera.fx = camera.fy = 380, camera.cx = 320, camera.cy = 240;
  return camera;
}

/// Returns corner residuals with noise and a pattern, in the whole image or only right of `from`.
std::vector<CornerResidual> residualsOf(double from, double pattern) {
  sim::Dice dice(5);
  std::vector<CornerResidual> all;
  for (int i = 0; i < 6000; ++i) {
    const Eigen::Vector2d pixel(dice.uniform(from, 640), dice.uniform(0, 480));
    const Eigen::Vector2d bend = pattern * (pixel - Eigen::Vector2d(320, 240)) / 400.0;
    all.push_back({0, 0.0, pixel, bend + 0.1 * Eigen::Vector2d(dice.normal(), dice.normal())});
  }
  return all;
}

CameraImu goodPlace() {
  CameraImu place;
  place.camera = camera640();
  place.covariance = 1e-10 * Matrix15d::Identity();
  place.rate_rms_B.setConstant(0.6), place.accel_rms_B.setConstant(2.0);
  place.sigma_px = 0.1;
  place.gyro = place.accel = {1.0, -0.1};
  place.residuals = residualsOf(0.0, 0.0);
  place.corners = place.residuals.size();
  return place;
}

Judgement worstJudgement(const Judgements& all) {
  return *std::max_element(all.begin(), all.end(),
                           [](const auto& a, const auto& b) { return a.grade < b.grade; });
}

TEST(Verdict, OfAGoodRecordingIsToUseIt) {
  const auto all = judgePlace(goodPlace(), camera640());
  EXPECT_EQ(worstOf(all), Grade::kGood) << worstJudgement(all).text;
  EXPECT_THAT(summaryOf(all), HasSubstr("use it"));
}

TEST(Verdict, NamesTheAxisThatWasNotTurned) {
  CameraImu place = goodPlace();
  place.rate_rms_B = {0.6, 0.05, 0.6};
  const auto worst = worstJudgement(judgePlace(place, camera640()));
  EXPECT_EQ(worst.grade, Grade::kBad);
  EXPECT_THAT(worst.text, HasSubstr("about its y axis"));
  EXPECT_THAT(worst.text, HasSubstr("turn it to and fro"));
}

TEST(Verdict, NamesTheAxisThatWasNotShaken) {
  CameraImu place = goodPlace();
  place.accel_rms_B = {2.0, 2.0, 0.4};
  const auto worst = worstJudgement(judgePlace(place, camera640()));
  EXPECT_EQ(worst.grade, Grade::kDoubtful);
  EXPECT_THAT(worst.text, HasSubstr("along its z axis"));
}

TEST(Verdict, NamesTheDirectionThatIsLeastKnown) {
  CameraImu place = goodPlace();
  place.covariance(kPositionAt + 1, kPositionAt + 1) = 0.004 * 0.004;
  const auto worst = worstJudgement(judgePlace(place, camera640()));
  EXPECT_EQ(worst.grade, Grade::kBad);
  EXPECT_THAT(worst.text, HasSubstr("4.00 mm"));
  EXPECT_THAT(worst.text, HasSubstr("IMU's y axis"));
}

TEST(Verdict, TellsNoiseThatIsNotWhite) {
  CameraImu place = goodPlace();
  place.gyro = {1.1, 0.7};
  const auto worst = worstJudgement(judgePlace(place, camera640()));
  EXPECT_EQ(worst.grade, Grade::kDoubtful);
  EXPECT_THAT(worst.text, HasSubstr("vibrates"));
  place.gyro = {2.5, 0.0};
  EXPECT_THAT(worstJudgement(judgePlace(place, camera640())).text,
              HasSubstr("set gyroscope_noise_density to 2.5 times"));
}

TEST(Verdict, SeesAPatternOfResidualsBelowTheirNoise) {
  CameraImu place = goodPlace();
  place.residuals = residualsOf(0.0, 0.3);
  const auto worst = worstJudgement(judgePlace(place, camera640()));
  EXPECT_NE(worst.grade, Grade::kGood);
  EXPECT_THAT(worst.text, HasSubstr("--lens"));
}

TEST(Verdict, SaysWhereTheBoardWasNotSeen) {
  EXPECT_EQ(judgeCoverage(camera640(), residualsOf(0.0, 0.0)).grade, Grade::kGood);
  const auto half = judgeCoverage(camera640(), residualsOf(240.0, 0.0));
  EXPECT_EQ(half.grade, Grade::kDoubtful);
  EXPECT_THAT(half.text, HasSubstr("upper left"));
  EXPECT_THAT(half.text, testing::Not(HasSubstr("right")));
}

TEST(Verdict, FlatViewsAreBad) {
  Intrinsics lens;
  lens.camera = camera640();
  lens.covariance = 1e-6 * Matrix8d::Identity();
  lens.sigma_px = 0.1;
  lens.T_CT.assign(30, RigidTransform(Eigen::Quaterniond::Identity(), {0, 0, 1}));
  lens.residuals = residualsOf(0.0, 0.0);
  lens.corners = lens.residuals.size();
  const auto worst = worstJudgement(judgeLens(lens, {}));
  EXPECT_EQ(worst.grade, Grade::kBad);
  EXPECT_THAT(worst.text, HasSubstr("20 to 40 degrees"));
}

}  // namespace
}  // namespace perdure::calibrate
