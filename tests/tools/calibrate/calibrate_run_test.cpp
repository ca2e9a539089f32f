// Tests the calibration from image files to a rig file that the services read.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "common/base/errors.h"
#include "common/math/so3.h"
#include "common/replay/dataset.h"
#include "common/replay/files/rig_file.h"
#include "tools/calibrate/calibrate.h"
#include "tools/calibrate/simulated.h"
#include "tools/simulate/writer.h"

namespace perdure::calibrate {
namespace {

namespace fs = std::filesystem;

class CalibrateRun : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = fs::path(testing::TempDir()) / "perdure_calibrate_run";
    fs::remove_all(folder_);
    SimulatedOptions options;
    options.board = board();
    options.seed = 2;
    options.seconds = 9.0;
    options.rate_hz = 10.0;
    options.width = 480, options.height = 360;
    simulated_ = simulateCalibration(options);
    writeSimulated(simulated_, folder_ / "drive", {});
  }
  static void TearDownTestSuite() { fs::remove_all(folder_); }
  static Board board() { return Board::parse("aprilgrid:4x3:0.1"); }

  inline static fs::path folder_;
  inline static SimulatedCalibration simulated_;
};

TEST_F(CalibrateRun, GoesFromImagesToARigThatADatasetTakes) {
  ReadOptions read;
  read.data = folder_ / "drive";
  const auto drive = readDrive(board(), read, {});
  ASSERT_EQ(drive.cameras.size(), 1u);
  EXPECT_GT(drive.cameras[0].views.size(), drive.cameras[0].images * 8 / 10);
  CalibrateOptions options;
  options.board = board();
  const auto calibrated = calibrate(drive, options);
  writeCalibrated(calibrated, folder_ / "out");

  const auto truth = replay::readRig(folder_ / "drive" / "rig_truth.yaml").cameras[0];
  const auto rig = replay::readRig(folder_ / "out" / "rig.yaml");
  ASSERT_EQ(rig.cameras.size(), 1u);
  const CameraCalibration& found = rig.cameras[0];
  EXPECT_NEAR(found.fx, truth.fx, 0.002 * truth.fx);
  EXPECT_NEAR(found.fy, truth.fy, 0.002 * truth.fy);
  EXPECT_NEAR(found.cx, truth.cx, 0.002 * truth.fx);
  EXPECT_NEAR(found.cy, truth.cy, 0.002 * truth.fx);
  EXPECT_LT(logSo3(Eigen::Quaterniond(found.T_BC.q.conjugate() * truth.T_BC.q)).norm(),
            0.1 * M_PI / 180);
  EXPECT_LT((found.T_BC.p - truth.T_BC.p).norm(), 3e-3);
  EXPECT_NEAR(found.time_offset_s, truth.time_offset_s, 3e-4);
  ASSERT_TRUE(rig.imu);
  EXPECT_EQ(rig.imu->gyro_noise, simulated_.scene.rig.calibration.imu->gyro_noise);

  const auto report = nlohmann::json::parse(reportText(calibrated));
  EXPECT_EQ(report["board"], board().text());
  EXPECT_EQ(report["cameras"]["cam0"]["camera_imu"]["covariance"].size(), 15u);
  EXPECT_GT(fs::file_size(folder_ / "out" / "residuals_cam0.png"), 5000u);

  replay::DatasetOptions again;
  again.path = folder_ / "drive";
  again.rig = folder_ / "out" / "rig.yaml";
  EXPECT_EQ(replay::Dataset::open(again)->calibration().cameras[0].fx, found.fx);
}

TEST_F(CalibrateRun, AFolderOfPicturesGivesTheLensAlone) {
  ReadOptions read;
  read.data = folder_ / "drive" / "mav0" / "cam0" / "data";
  read.every = 2;
  const auto drive = readDrive(board(), read, {});
  EXPECT_TRUE(drive.samples.empty());
  CalibrateOptions options;
  options.board = board();
  options.intrinsics_only = true;
  const auto calibrated = calibrate(drive, options);
  ASSERT_FALSE(calibrated.cameras[0].place);
  const CameraCalibration& truth = simulated_.truth();
  EXPECT_NEAR(calibrated.rig.cameras[0].fx, truth.fx, 0.004 * truth.fx);
  writeCalibrated(calibrated, folder_ / "lens");
  EXPECT_EQ(replay::readRig(folder_ / "lens" / "rig.yaml").cameras[0].width, truth.width);
}

TEST_F(CalibrateRun, AnotherBoardIsNotFoundAndTheFixIsSaid) {
  ReadOptions read;
  read.data = folder_ / "drive";
  read.every = 10;
  try {
    readDrive(Board::parse("chessboard:9x6:0.03"), read, {});
    FAIL() << "found a chessboard on a grid";
  } catch (const StartupError& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("inner corners are counted"));
    EXPECT_EQ(error.code(), ExitCode::kUnavailable);
  }
}

}  // namespace
}  // namespace perdure::calibrate
