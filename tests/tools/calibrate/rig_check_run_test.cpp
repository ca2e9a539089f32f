// Checks a correct rig and incorrect rigs on one rendered walk.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "common/math/so3.h"
#include "common/replay/dataset.h"
#include "common/replay/files/rig_file.h"
#include "tools/calibrate/rig_check.h"
#include "tools/simulate/simulate.h"

namespace perdure::calibrate {
namespace {

namespace fs = std::filesystem;

class RigCheckRun : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = fs::path(testing::TempDir()) / "perdure_rig_check";
    fs::remove_all(folder_);
    tools::SimulateOptions options;
    options.scene = "room";
    options.seed = 3;
    options.world.seconds = 15.0;
    options.world.mono8 = true;
    options.world.width = 480, options.world.height = 360;
    options.out = folder_ / "drive";
    tools::simulate(options, {});
    rig_ = replay::Dataset::open({.path = folder_ / "drive"})->calibration();
  }
  static void TearDownTestSuite() { fs::remove_all(folder_); }

  static RigCheck checkOf(const Calibration& rig, bool until_sure = false) {
    std::ofstream(folder_ / "rig.yaml") << replay::rigText(rig, "");
    const auto drive = replay::Dataset::open({.path = folder_ / "drive",
                                              .encoding = ImageEncoding::kMono8,
                                              .rig = folder_ / "rig.yaml"});
    return checkRig(*drive, {.data = folder_ / "drive", .until_sure = until_sure});
  }

  inline static fs::path folder_;
  inline static Calibration rig_;
};

TEST_F(RigCheckRun, ARightRigIsGood) {
  for (const Judgement& j : judgeRig(checkOf(rig_))) EXPECT_EQ(j.grade, Grade::kGood) << j.text;
}

// A rig with an error is checked to the end of the drive.
TEST_F(RigCheckRun, EndsEarlyOnlyWhereAllIsGood) {
  Calibration rig = rig_;
  rig.cameras[0].time_offset_s = 0.012;
  EXPECT_EQ(checkOf(rig, true).frames, 300U);
}

TEST_F(RigCheckRun, ATurnedCameraIsFoundByHowFar) {
  Calibration rig = rig_;
  rig.cameras[0].T_BC.q = rig.cameras[0].T_BC.q * expQuaternion({0.035, 0, 0});
  const RigCheck check = checkOf(rig);
  EXPECT_NEAR(check.turned.norm(), 0.035, 0.005);
  EXPECT_EQ(worstOf(judgeRig(check)), Grade::kBad);
}

TEST_F(RigCheckRun, ATimeOffsetIsFound) {
  Calibration rig = rig_;
  rig.cameras[0].time_offset_s = 0.012;
  const RigCheck check = checkOf(rig);
  EXPECT_NEAR(check.later_s, -0.012, 0.001);
  EXPECT_EQ(worstOf(judgeRig(check)), Grade::kBad);
}

TEST_F(RigCheckRun, AWrongLensIsNotGood) {
  Calibration rig = rig_;
  rig.cameras[0].distortion_coefficients.assign(4, 0.0);
  EXPECT_NE(worstOf(judgeRig(checkOf(rig))), Grade::kGood);
}

}  // namespace
}  // namespace perdure::calibrate
