#include "common/replay/files/rig_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "common/base/errors.h"
#include "common/math/so3.h"

namespace perdure::replay {
namespace {

namespace fs = std::filesystem;

Calibration someRig() {
  Calibration rig;
  CameraCalibration camera;
  camera.name = "cam0";
  camera.width = 640, camera.height = 480;
  camera.fx = 381.25, camera.fy = 380.5, camera.cx = 320.1, camera.cy = 239.9;
  camera.distortion = DistortionModel::kEquidistant;
  camera.distortion_coefficients = {-0.01, 1.0 / 3.0, 1e-7, -2e-4};
  camera.T_BC = RigidTransform(expQuaternion({0.3, -1.1, 0.7}), {0.01, -0.2, 1.0 / 7.0});
  camera.time_offset_s = -0.00812345678912;
  camera.readout_s = 0.0175;
  camera.rate_hz = 20.0;
  camera.deviations = {0.003, 2.0, 0.005, 0.01, 0.01, 1.0 / 300.0};
  rig.cameras = {camera, camera};
  rig.cameras[1].name = "cam1";
  rig.cameras[1].distortion = DistortionModel::kNone;
  rig.cameras[1].distortion_coefficients.clear();
  rig.imu = ImuCalibration{1.7e-4, 2e-5, 2e-3, 3e-3, 200.0};
  return rig;
}

class RigFile : public testing::Test {
 protected:
  fs::path write(const std::string& text) const {
    const fs::path file = fs::path(testing::TempDir()) /
                          (std::string("perdure_rig_") +
                           testing::UnitTest::GetInstance()->current_test_info()->name() + ".yaml");
    std::ofstream(file) << text;
    return file;
  }
};

TEST_F(RigFile, IsReadAsItWasWrittenToTheLastDigit) {
  const Calibration rig = someRig();
  const Calibration again = readRig(write(rigText(rig, "two\nlines")));
  ASSERT_EQ(again.cameras.size(), 2u);
  for (std::size_t i = 0; i < 2; ++i) {
    const CameraCalibration &a = rig.cameras[i], &b = again.cameras[i];
    EXPECT_EQ(a.name, b.name);
    EXPECT_EQ(a.fx, b.fx);
    EXPECT_EQ(a.cy, b.cy);
    EXPECT_EQ(a.distortion, b.distortion);
    EXPECT_EQ(a.distortion_coefficients, b.distortion_coefficients);
    EXPECT_LT(boxMinus(a.T_BC, b.T_BC).norm(), 1e-14);
    EXPECT_EQ(a.time_offset_s, b.time_offset_s);
    EXPECT_EQ(a.readout_s, b.readout_s);
    EXPECT_EQ(a.deviations, b.deviations);
  }
  EXPECT_EQ(again.imu->accel_bias_walk, rig.imu->accel_bias_walk);
}

TEST_F(RigFile, SaysWhatIsWrongAndWhere) {
  const auto complaint = [&](const std::string& text) -> std::string {
    try {
      readRig(write(text));
    } catch (const StartupError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_THAT(complaint("imu0:\n  rate_hz: 200\n"), testing::HasSubstr("cam0 is missing"));
  std::string text = rigText(someRig(), "");
  text.replace(text.find("381.25"), 6, "-1");
  EXPECT_THAT(complaint(text), testing::HasSubstr("cam0: intrinsics"));
  EXPECT_THAT(complaint("cam0: 3\n"), testing::HasSubstr("cam0"));
  EXPECT_THAT(complaint("cam0: [\n"), testing::HasSubstr(".yaml"));
  EXPECT_THAT(complaint("Calibration results\n===\nerror (cam0): mean 0.3\n"),
              testing::HasSubstr("Kalibr's report"));
  EXPECT_THROW(readRig("/nowhere/rig.yaml"), StartupError);
  EXPECT_THAT(complaint("cam0:\n\tT_BS:\n"),
              testing::HasSubstr(":2: the line is indented with a tab"));
  EXPECT_THAT(complaint("cam0: a: b\n"), testing::HasSubstr(".yaml:1:8: illegal map value"));
  EXPECT_THAT(complaint("Camera-system parameters:\n\tcam0 (/cam0):\n"),
              testing::HasSubstr("Kalibr's report"));
  EXPECT_THAT(complaint("# Camera list with one line of data per camera:\n1 OPENCV 320 240\n"),
              testing::HasSubstr("COLMAP's cameras.txt"));
  EXPECT_THAT(complaint("\xFF\xD8\xFF\xE0 JFIF\n"), testing::HasSubstr("is a JPEG image"));
  EXPECT_THAT(complaint("{\"ppx\": 160, \"coeffs\": []}"),
              testing::AllOf(testing::HasSubstr("librealsense"), testing::HasSubstr("--rig auto")));
}

TEST_F(RigFile, DeviationsAreOptionalAndWrongOnesAreNamedWithTheirLine) {
  const std::string text = rigText(someRig(), "");
  const auto with = [&](const std::string& line) {
    std::string changed = text;
    const auto at = changed.find("  focal_sigma");
    return changed.replace(at, changed.find('\n', at) + 1 - at, line);
  };
  const CameraDeviations without = readRig(write(with(""))).cameras[0].deviations;
  EXPECT_EQ(without.focal, 0.0);
  EXPECT_EQ(without.centre_px, 2.0);
  const auto at = text.begin() + static_cast<long>(text.find("focal_sigma"));
  const std::string line = std::to_string(1 + std::count(text.begin(), at, '\n'));
  for (const std::string value : {"0", "-0.1", "0.5", "little", "[0.1]", ".nan"}) {
    try {
      readRig(write(with("  focal_sigma: " + value + "\n")));
      ADD_FAILURE() << value;
    } catch (const StartupError& error) {
      EXPECT_THAT(error.what(), testing::AllOf(testing::HasSubstr("cam0: focal_sigma"),
                                               testing::HasSubstr("(line " + line + ")")));
    }
  }
}

TEST_F(RigFile, TakesThePlaceOfADrivesCalibration) {
  Calibration drive = someRig();
  drive.cameras.pop_back();
  drive.cameras[0].fx = 300.0;
  applyRig(someRig(), "rig.yaml", drive);
  ASSERT_EQ(drive.cameras.size(), 1u);
  EXPECT_EQ(drive.cameras[0].fx, 381.25);
  EXPECT_EQ(drive.cameras[0].time_offset_s, someRig().cameras[0].time_offset_s);
}

TEST_F(RigFile, OfAnotherSizeOrWithoutACameraIsRefused) {
  Calibration drive = someRig();
  drive.cameras[0].width = 752;
  EXPECT_THROW(applyRig(someRig(), "rig.yaml", drive), StartupError);
  Calibration mono = someRig();
  mono.cameras.pop_back();
  Calibration stereo = someRig();
  EXPECT_THROW(applyRig(mono, "rig.yaml", stereo), StartupError);
}

TEST_F(RigFile, AKeyThatIsThereTwiceIsRefused) {
  const std::string text = rigText(someRig(), "");
  const auto refusalOf = [&](const std::string& twice) {
    try {
      readRig(write(twice));
    } catch (const StartupError& error) {
      EXPECT_EQ(error.code(), ExitCode::kData);
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_THAT(refusalOf(text + text), testing::HasSubstr("the key `cam0` is there twice"));
  std::string in_section = text;
  const auto at = in_section.find("  rate_hz");
  in_section.insert(at, in_section.substr(at, in_section.find('\n', at) + 1 - at));
  EXPECT_THAT(refusalOf(in_section), testing::HasSubstr("the key `rate_hz` is there twice"));
}

}  // namespace
}  // namespace perdure::replay
