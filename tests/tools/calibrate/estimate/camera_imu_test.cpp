#include "tools/calibrate/estimate/camera_imu.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "common/math/so3.h"
#include "tools/calibrate/simulated.h"
#include "tools/calibrate/verdict.h"

namespace perdure::calibrate {
namespace {

struct Case {
  SimulatedCalibration simulated;
  CameraImuInput input;
};

/// Makes noisy corners, a lens with a small error, and the camera's pose from a data sheet.
Case caseOf(const char* board, std::uint64_t seed, double readout_s = 0.0) {
  SimulatedOptions options;
  options.board = Board::parse(board);
  options.seed = seed;
  options.seconds = readout_s > 0.0 ? 10.0 : 16.0;
  options.readout_s = readout_s;
  Case c{simulateCalibration(options), {}};
  CameraCalibration camera = c.simulated.truth();
  camera.fx *= 1.001, camera.cx += 0.5;
  camera.T_BC = c.simulated.scene.rig.calibration.cameras[0].T_BC;
  camera.time_offset_s = 0.0;
  c.input = {options.board, simulateViews(c.simulated, 0.1),        simulateSamples(c.simulated),
             camera,        *c.simulated.scene.rig.calibration.imu, 0.1};
  return c;
}

constexpr char kSmallGrid[] = "aprilgrid:4x3:0.1";

/// Checks the errors against fixed limits and against the stated covariance: 0.01 % … 99.99 % of χ²
/// with 15 degrees of freedom.
void expectTruth(const Case& c, const CameraImu& found) {
  const CameraCalibration& truth = c.simulated.truth();
  Eigen::Matrix<double, 15, 1> error;
  error << logSo3(Eigen::Quaterniond(found.camera.T_BC.q.conjugate() * truth.T_BC.q)),
      truth.T_BC.p - found.camera.T_BC.p, truth.time_offset_s - found.camera.time_offset_s,
      lensOf(truth) - lensOf(found.camera);
  EXPECT_LT(error.head<3>().norm(), 0.1 * M_PI / 180.0);
  EXPECT_LT(error.segment<3>(kPositionAt).norm(), 3e-3);
  EXPECT_LT(std::abs(error[kOffsetAt]), 3e-4);
  EXPECT_LT(error.segment<4>(kLensAt).cwiseAbs().maxCoeff(), 0.002 * truth.fx);
  const double nees = error.dot(found.covariance.inverse() * error);
  EXPECT_GT(nees, 1.6) << error.transpose();
  EXPECT_LT(nees, 44.3) << error.transpose();
  EXPECT_LT((found.gyro_bias - c.simulated.scene.rig.imu.gyro_bias).norm(), 1e-3);
  EXPECT_LT((found.accel_bias - c.simulated.scene.rig.imu.accel_bias).norm(), 0.05);
  const Eigen::Vector3d down = c.simulated.T_WT.q.conjugate() * -Eigen::Vector3d::UnitZ();
  EXPECT_LT(std::acos(std::min(1.0, down.dot(found.gravity_T.normalized()))), 3e-3);
  EXPECT_NEAR(found.sigma_px, 0.1, 0.01);
  EXPECT_NEAR(found.gyro.ratio, 1.0, 0.08);
  EXPECT_NEAR(found.accel.ratio, 1.0, 0.08);
}

TEST(CameraImu, FromAChessboardMeetsTheTruthWithinItsStatedErrors) {
  const Case c = caseOf("chessboard:7x6:0.06", 11);
  const auto found = estimateCameraImu(c.input, {});
  ASSERT_TRUE(found) << found.error().detail;
  expectTruth(c, *found);
}

TEST(CameraImu, FromAGridMeetsTheTruthWithinItsStatedErrors) {
  const Case c = caseOf(kSmallGrid, 12);
  const auto found = estimateCameraImu(c.input, {});
  ASSERT_TRUE(found) << found.error().detail;
  expectTruth(c, *found);
}

TEST(CameraImu, RowsOfARollingShutterHaveTheirOwnTimes) {
  const Case c = caseOf(kSmallGrid, 13, 0.02);
  const auto found = estimateCameraImu(c.input, {});
  ASSERT_TRUE(found) << found.error().detail;
  expectTruth(c, *found);
}

TEST(CameraImu, CornersThatAreElsewhereAreLeftOut) {
  Case c = caseOf(kSmallGrid, 14);
  std::size_t count = 0;
  for (View& view : c.input.views) {
    for (Corner& corner : view.corners) {
      if (++count % 60 == 0) corner.pixel += Eigen::Vector2d(6.0, 3.0);
    }
  }
  const auto found = estimateCameraImu(c.input, {});
  ASSERT_TRUE(found) << found.error().detail;
  expectTruth(c, *found);
  EXPECT_NEAR(static_cast<double>(found->outliers), static_cast<double>(count) / 60.0,
              static_cast<double>(count) / 600.0);
}

TEST(CameraImu, ViewsThatWereReadUpsideDownAreLeftOut) {
  Case c = caseOf("chessboard:7x6:0.06", 11);
  const std::size_t last = c.input.board.cornerCount() - 1;
  for (std::size_t i = 20; i < c.input.views.size(); i += 30) {
    for (Corner& corner : c.input.views[i].corners) corner.id = last - corner.id;
  }
  const auto found = estimateCameraImu(c.input, {});
  ASSERT_TRUE(found) << found.error().detail;
  expectTruth(c, *found);
}

TEST(CameraImu, AGapWithoutTheBoardLeavesTheLongerStretch) {
  Case c = caseOf(kSmallGrid, 12);
  const TimePoint begin = c.input.views.front().time;
  std::erase_if(c.input.views, [&](const View& view) {
    const double t = toSeconds(view.time - begin);
    return t > 3.0 && t < 4.5;
  });
  const auto found = estimateCameraImu(c.input, {});
  ASSERT_TRUE(found) << found.error().detail;
  EXPECT_GT(found->from_s, 4.4);
  expectTruth(c, *found);
}

void expectRefusal(const CameraImuInput& input, const std::string& code, const std::string& fix) {
  const auto found = estimateCameraImu(input, {});
  ASSERT_FALSE(found) << code;
  EXPECT_EQ(found.error().code, code) << found.error().detail;
  EXPECT_NE(found.error().detail.find(fix), std::string::npos) << found.error().detail;
}

TEST(CameraImu, SaysWhatIsMissingAndTheFix) {
  const Case whole = caseOf(kSmallGrid, 12);
  Case c = whole;
  c.input.samples.clear();
  expectRefusal(c.input, "calibrate_imu_missing", "--intrinsics-only");
  c = whole;
  c.input.views.resize(30);
  expectRefusal(c.input, "calibrate_few_views", "20 s or more");
  c = whole;
  c.input.views.clear();
  expectRefusal(c.input, "calibrate_few_views", "--board");
  c = whole;
  for (ImuSample& sample : c.input.samples) sample.time += std::chrono::seconds(3600);
  expectRefusal(c.input, "calibrate_imu_missing", "one clock");
  c = whole;
  c.input.samples.erase(c.input.samples.begin() + 1500, c.input.samples.begin() + 1600);
  expectRefusal(c.input, "calibrate_imu_missing", "less load");
  c = whole;
  for (ImuSample& sample : c.input.samples) {
    sample.gyro = sample.gyro.cwiseMin(1.1).cwiseMax(-1.1);
  }
  expectRefusal(c.input, "calibrate_imu_saturated", "wider range");
}

TEST(CameraImu, SlowMotionIsToldByItsStatedErrorsAndByTheVerdict) {
  SimulatedOptions options;
  options.board = Board::parse(kSmallGrid);
  options.seed = 16;
  options.seconds = 10.0;
  options.shake = false;
  const auto simulated = simulateCalibration(options);
  const CameraImuInput input{
      options.board,     simulateViews(simulated, 0.1),        simulateSamples(simulated),
      simulated.truth(), *simulated.scene.rig.calibration.imu, 0.1};
  const auto found = estimateCameraImu(input, {});
  ASSERT_TRUE(found) << found.error().detail;
  EXPECT_GT(found->covariance.diagonal().segment<3>(kPositionAt).maxCoeff(), 1e-6);
  const auto all = judgePlace(*found, simulated.truth());
  EXPECT_EQ(worstOf(all), Grade::kBad);
  EXPECT_TRUE(std::any_of(all.begin(), all.end(), [](const Judgement& j) {
    return j.text.find("shake it to and fro") != std::string::npos;
  }));
}

TEST(CameraImu, AnImuThatIsNotOnTheCameraIsNotBelieved) {
  Case c = caseOf(kSmallGrid, 12);
  const Case other = caseOf(kSmallGrid, 15);
  c.input.samples = other.input.samples;
  const auto found = estimateCameraImu(c.input, {});
  ASSERT_FALSE(found);
  EXPECT_EQ(found.error().code, "calibrate_time_offset") << found.error().detail;
}

TEST(CameraImu, KnotsAreCloserWhereTheMotionIsFaster) {
  const auto intervalAt = [](double rate_hz) {
    std::vector<ImuReading> readings;
    for (int i = 0; i < 4000; ++i) {
      const double t = i / 200.0, wave = std::sin(2 * M_PI * rate_hz * t);
      const double noise = 0.01 * std::sin(1e4 * t * t);
      readings.push_back({t, Eigen::Vector3d(wave + noise, noise, -noise),
                          Eigen::Vector3d(noise, 9.8 + wave + noise, noise)});
    }
    return chooseKnotInterval(readings);
  };
  EXPECT_GE(intervalAt(0.3), 0.14);
  EXPECT_LE(intervalAt(4.0), 0.05);
}

}  // namespace
}  // namespace perdure::calibrate
