#include "tools/data_check/rig_numbers.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <string>

namespace perdure::tools {
namespace {

using ::testing::HasSubstr;

/// The calibration of EuRoC.
Calibration soundRig() {
  Calibration rig;
  CameraCalibration camera;
  camera.name = "cam0";
  camera.width = 752, camera.height = 480;
  camera.fx = 458.7, camera.fy = 457.3, camera.cx = 367.2, camera.cy = 248.4;
  rig.cameras = {camera};
  rig.imu = ImuCalibration{1.7e-4, 1.9e-5, 2e-3, 3e-3, 200.0};
  return rig;
}

replay::DataFindings findingsWith(const std::function<void(Calibration&)>& change) {
  Calibration rig = soundRig();
  change(rig);
  return checkRigNumbers(rig);
}

std::string codeOf(const replay::DataFindings& findings) {
  return findings.size() == 1 ? findings[0].code : std::to_string(findings.size()) + " findings";
}

TEST(RigNumbers, ASoundRigHasNoFinding) {
  EXPECT_TRUE(checkRigNumbers(soundRig()).empty());
  const auto fisheye = [](Calibration& rig) { rig.cameras[0].fx = rig.cameras[0].fy = 200.0; };
  EXPECT_TRUE(findingsWith(fisheye).empty());
}

TEST(RigNumbers, IntrinsicsThatAreNoPixelsAreRefused) {
  const auto shares = findingsWith([](Calibration& rig) {
    auto& camera = rig.cameras[0];
    camera.fx /= 752, camera.fy /= 480, camera.cx /= 752, camera.cy /= 480;
  });
  ASSERT_EQ(codeOf(shares), "intrinsics_unit");
  EXPECT_EQ(shares[0].grade, replay::DataFinding::Grade::kFatal);
  EXPECT_THAT(shares[0].text, HasSubstr("multiply fx and cx by the width"));
  const auto millimetres =
      findingsWith([](Calibration& rig) { rig.cameras[0].fx = rig.cameras[0].fy = 4.0; });
  ASSERT_EQ(codeOf(millimetres), "intrinsics_unit");
  EXPECT_THAT(millimetres[0].text, HasSubstr("millimetres"));
}

TEST(RigNumbers, IntrinsicsInAnotherOrderAreDoubtful) {
  const auto exchanged = findingsWith([](Calibration& rig) {
    auto& camera = rig.cameras[0];
    std::swap(camera.fx, camera.cx), std::swap(camera.fy, camera.cy);
  });
  ASSERT_EQ(codeOf(exchanged), "intrinsics_order");
  EXPECT_THAT(exchanged[0].text, HasSubstr("their order, fx, fy, cx, cy"));
  const auto of_half_size = findingsWith([](Calibration& rig) {
    auto& camera = rig.cameras[0];
    camera.width *= 4, camera.height *= 4;
  });
  EXPECT_EQ(codeOf(of_half_size), "intrinsics_order");
}

TEST(RigNumbers, AnOffsetOfSecondsAndNoiseInDegreesAreDoubtful) {
  const auto offset = findingsWith([](Calibration& rig) { rig.cameras[0].time_offset_s = 20.0; });
  ASSERT_EQ(codeOf(offset), "time_offset_large");
  EXPECT_THAT(offset[0].text, HasSubstr("Then write 0.02"));
  const auto noise = findingsWith([](Calibration& rig) { rig.imu->gyro_noise = 9.7e-3; });
  ASSERT_EQ(codeOf(noise), "imu_noise_large");
  EXPECT_THAT(noise[0].text, HasSubstr("in degrees (then 0.000169)"));
}

TEST(RigNumbers, ALensThatFoldsTheImageOverIsNamed) {
  const auto findingsOf = [](DistortionModel model, std::vector<double> coefficients) {
    return findingsWith([&](Calibration& rig) {
      rig.cameras[0].distortion = model;
      rig.cameras[0].distortion_coefficients = coefficients;
    });
  };
  const auto radial = DistortionModel::kRadialTangential;
  EXPECT_TRUE(findingsOf(radial, {-0.2834, 0.0740, 1.9e-4, 1.8e-5}).empty()) << "EuRoC's";
  const auto some = findingsOf(radial, {-0.4, 0, 0, 0});
  ASSERT_EQ(codeOf(some), "lens_folds");
  EXPECT_EQ(some[0].grade, replay::DataFinding::Grade::kWarning);
  const auto most = findingsOf(radial, {-1e300, 1e300, 0, 0});
  ASSERT_EQ(codeOf(most), "lens_folds");
  EXPECT_EQ(most[0].grade, replay::DataFinding::Grade::kFatal);
  const auto equidistant = DistortionModel::kEquidistant;
  EXPECT_TRUE(findingsOf(equidistant, {-0.005, 0.003, -0.004, 0.001}).empty());
  EXPECT_EQ(codeOf(findingsOf(equidistant, {-0.8, 0, 0, 0})), "lens_folds");
}

TEST(RigNumbers, AReadoutOfSecondsAndNoiseOfNothingAreDoubtful) {
  const auto readout = findingsWith([](Calibration& rig) { rig.cameras[0].readout_s = 15.0; });
  ASSERT_EQ(codeOf(readout), "readout_large");
  EXPECT_THAT(readout[0].text, HasSubstr("write 0.015"));
  EXPECT_EQ(codeOf(findingsWith([](Calibration& rig) { rig.cameras[0].readout_s = 0.03; })),
            "0 findings");
  EXPECT_EQ(codeOf(findingsWith([](Calibration& rig) { rig.imu->gyro_noise = 0.0; })),
            "imu_noise_zero");
}

}  // namespace
}  // namespace perdure::tools
