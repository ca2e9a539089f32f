#include "services/vio/core/estimator.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>

#include "common/math/chi2.h"
#include "common/math/so3.h"
#include "tests/services/vio/simulated_drive.h"

namespace perdure::vio {
namespace {

using Eigen::Vector3d;

struct RunResult {
  double position_error = 0.0, largest_error = 0.0;
  double nees_pose = 0.0;  ///< mean over frames of the NEES of [θ, p]
  int frames = 0;
  std::vector<FrameEstimate> estimates;
};

struct RunOptions {
  double seconds = 20.0;
  bool speed = false;
  double start_sigma_scale = 1.0;
};

RunResult run(const test::DriveOptions& drive_options, const Options& options,
              const RunOptions& how) {
  test::SimulatedDrive drive(drive_options);
  ImuBuffer imu;
  for (const ImuReading& r : drive.imu(how.seconds + 1.0)) EXPECT_TRUE(imu.add(r));
  Estimator estimator(options, drive.T_BC(), 0.0);
  estimator.start(test::startAt(drive, 0.2, drive_options.seed, how.start_sigma_scale));
  RunResult result;
  std::uint64_t frame = 0;
  for (double t = 0.25; t < how.seconds; t += 1.0 / drive_options.camera_rate_hz) {
    FrameInput input{++frame, drive.time(t), drive.see(t), {}, {}};
    const Nav truth = drive.truth(t + drive_options.time_offset_s);
    if (how.speed) input.speed = SpeedReading{(truth.q_WB.conjugate() * truth.v_WB).x(), 0.05};
    const auto out = estimator.process(input, imu);
    EXPECT_TRUE(out) << out.error().code;
    if (!out) break;
    Eigen::Matrix<double, 6, 1> e;
    e << logSo3(out->nav.q_WB.conjugate() * truth.q_WB), truth.p_WB - out->nav.p_WB;
    result.position_error = e.tail<3>().norm();
    result.largest_error = std::max(result.largest_error, result.position_error);
    result.nees_pose += e.dot(out->covariance.topLeftCorner<6, 6>().ldlt().solve(e));
    ++result.frames;
    result.estimates.push_back(*out);
  }
  result.nees_pose /= result.frames;
  return result;
}

TEST(Estimator, FollowsTheSimulatedDriveWithOneCamera) {
  const RunResult r = run({}, Options{}, {.seconds = 30.0});
  EXPECT_LT(r.position_error, 0.25);
  EXPECT_LT(r.nees_pose, 15.0);
}

TEST(Estimator, FollowsTheSimulatedDriveWithTwoCameras) {
  test::DriveOptions drive;
  drive.stereo = true;
  const RunResult r = run(drive, Options{}, {.seconds = 20.0});
  EXPECT_LT(r.position_error, 0.15);
}

TEST(Estimator, FindsTheTimeOffset) {
  test::DriveOptions drive;
  drive.time_offset_s = 0.006;
  test::SimulatedDrive world(drive);
  ImuBuffer imu;
  for (const ImuReading& r : world.imu(16.0)) ASSERT_TRUE(imu.add(r));
  Estimator estimator(Options{}, world.T_BC(), 0.0);
  estimator.start(test::startAt(world, 0.2, 1, 1.0));
  std::uint64_t frame = 0;
  for (double t = 0.25; t < 15.0; t += 0.05) {
    ASSERT_TRUE(estimator.process({++frame, world.time(t), world.see(t), {}, {}}, imu));
  }
  EXPECT_NEAR(estimator.state().time_offset_s, 0.006, 0.001);
}

TEST(Estimator, PoseErrorsLieInTheBandOfTheirCovarianceOverSeededRuns) {
  constexpr int kRuns = 12;
  Options options;  // the calibration of the drive is exact
  options.calibration.estimate_extrinsics = options.calibration.estimate_time_offset = false;
  double sum = 0.0;
  for (int seed = 1; seed <= kRuns; ++seed) {
    test::DriveOptions drive;
    drive.seed = static_cast<unsigned>(seed);
    drive.walking_biases = true;
    sum += run(drive, options, {.seconds = 10.0}).nees_pose;
  }
  // Frames of one run are correlated. The band is therefore the 99 % band of the number of runs.
  const double mean = sum / kRuns;
  EXPECT_GT(mean, chi2Quantile(0.005, 6 * kRuns) / kRuns);
  EXPECT_LT(mean, chi2Quantile(0.995, 6 * kRuns) / kRuns);
}

TEST(Estimator, TheIncrementExplainsThePoseCovariance) {
  const RunResult r = run({}, Options{}, {.seconds = 5.0});
  for (std::size_t k = 1; k < r.estimates.size(); ++k) {
    const FrameEstimate &a = r.estimates[k - 1], &b = r.estimates[k];
    ASSERT_TRUE(b.has_increment);
    const Matrix6d P =
        b.transition * a.covariance.topLeftCorner<6, 6>() * b.transition.transpose() +
        b.increment_covariance;
    const Matrix6d P_b = b.covariance.topLeftCorner<6, 6>();
    EXPECT_LT((P - P_b).norm(), 1e-2 * P_b.norm() + 1e-9) << k;
  }
}

TEST(Estimator, HoldsThePositionWhileItTurnsOnTheSpot) {
  for (const unsigned seed : {1u, 2u}) {
    test::DriveOptions drive;
    drive.place = test::DrivePlace::kSpot;
    drive.seed = seed;
    drive.rest_s = 1.0;
    const RunResult r = run(drive, Options{}, {.seconds = 60.0, .start_sigma_scale = 0.5});
    EXPECT_LT(r.largest_error, 0.3);
    const double sigma = std::sqrt(r.estimates.back().covariance.block<3, 3>(3, 3).trace());
    EXPECT_LT(r.position_error, 3.0 * sigma);
  }
}

TEST(Estimator, KnowsThatItSupposedTheLengthOfASlowTurnAtArmsLength) {
  test::DriveOptions drive;
  drive.place = test::DrivePlace::kSpot;
  drive.rest_s = 1.0;
  drive.spot_radius_m = 0.3;
  drive.spot_pace = 0.2;
  const RunResult r = run(drive, Options{}, {.seconds = 30.0, .start_sigma_scale = 0.5});
  EXPECT_LT(r.largest_error, 1.0);
  const double sigma = std::sqrt(r.estimates.back().covariance.block<3, 3>(3, 3).trace());
  EXPECT_LT(r.position_error, 3.0 * sigma);
}

TEST(Estimator, SpeedHoldsTheScaleOfOneCamera) {
  test::DriveOptions drive;
  drive.noise.accel = 0.1;  // accelerometer noise that hides the scale
  Options options;
  options.imu.accel = 0.1;
  const RunResult without = run(drive, options, {.seconds = 20.0});
  const RunResult with = run(drive, options, {.seconds = 20.0, .speed = true});
  EXPECT_LT(with.position_error, 0.5);
  const auto uncertainty = [](const RunResult& r) {
    return r.estimates.back().covariance.diagonal().segment<3>(3).sum();
  };
  EXPECT_LT(uncertainty(with), uncertainty(without));
}

TEST(Estimator, StandsStillAtRestAndThenFollows) {
  test::DriveOptions drive_options;
  drive_options.rest_s = 4.0;
  test::SimulatedDrive drive(drive_options);
  ImuBuffer imu;
  for (const ImuReading& r : drive.imu(13.0)) ASSERT_TRUE(imu.add(r));
  Estimator estimator(Options{}, drive.T_BC(), 0.0);
  estimator.start(test::startAt(drive, 0.2, 3, 1.0));
  const Vector3d origin = drive.truth(0.2).p_WB;
  std::uint64_t frame = 0;
  int rests = 0;
  for (double t = 0.25; t < 12.0; t += 0.05) {
    FrameInput input{++frame, drive.time(t), drive.see(t), {}, {}};
    input.motion_px = t < 4.0 ? 0.1 : 20.0;
    const auto out = estimator.process(input, imu);
    ASSERT_TRUE(out) << out.error().code;
    rests += out->at_rest;
    if (t < 4.0) {
      EXPECT_LT((out->nav.p_WB - origin).norm(), 0.05) << t;
    }
    EXPECT_TRUE(out->has_increment || frame == 1);
    if (t > 11.9) {
      EXPECT_LT((out->nav.p_WB - drive.truth(t).p_WB).norm(), 0.3);
    }
  }
  EXPECT_GT(rests, 60);
}

TEST(Estimator, ImageMotionAloneDoesNotMakeARestOfADrive) {
  test::SimulatedDrive drive({});
  ImuBuffer imu;
  for (const ImuReading& r : drive.imu(3.0)) ASSERT_TRUE(imu.add(r));
  Estimator estimator(Options{}, drive.T_BC(), 0.0);
  estimator.start(test::startAt(drive, 0.2, 3, 1.0));
  for (std::uint64_t k = 1; k < 40; ++k) {
    const double t = 0.2 + 0.05 * static_cast<double>(k);
    // A lorry ahead fills the image and moves with the body.
    const auto out = estimator.process({k, drive.time(t), drive.see(t), 0.1, {}}, imu);
    ASSERT_TRUE(out);
    EXPECT_FALSE(out->at_rest);
  }
}

TEST(Estimator, LandmarksLieWithinTheirCovariance) {
  test::DriveOptions options;
  options.stereo = true;
  test::SimulatedDrive drive(options);
  ImuBuffer imu;
  for (const ImuReading& r : drive.imu(6.0)) ASSERT_TRUE(imu.add(r));
  Estimator estimator(Options{}, drive.T_BC(), 0.0);
  estimator.start(test::startAt(drive, 0.2, 5, 1.0));
  for (std::uint64_t k = 1; k < 100; ++k) {
    const double t = 0.2 + 0.05 * static_cast<double>(k);
    ASSERT_TRUE(estimator.process({k, drive.time(t), drive.see(t), {}, {}}, imu));
  }
  const double t = 0.2 + 0.05 * 99;
  const Matrix6d P = estimator.state().covarianceOf({{estimator.state().clones.back().at, 6}});
  double nees = 0.0;
  int count = 0;
  for (const Landmark& l : estimator.landmarks()) {
    std::size_t nearest = 0;
    double best = 1e9;
    for (std::size_t i = 0; i < drive.points().size(); ++i) {
      const double d = (drive.pixelOf(i, t) - l.pixel).norm();
      if (d < best) best = d, nearest = i;
    }
    if (best > 4.0) continue;
    const Eigen::Matrix3d marginal =
        l.covariance + l.cross_pose * P.ldlt().solve(l.cross_pose.transpose());
    const Vector3d e = l.p_W - drive.points()[nearest];
    nees += std::min(e.dot(marginal.ldlt().solve(e)), 50.0);
    ++count;
  }
  EXPECT_GT(count, 40);
  EXPECT_LT(nees / count, 6.0);
}

TEST(Estimator, BadNumbersStopItWithAReason) {
  test::SimulatedDrive drive({});
  ImuBuffer imu;
  for (const ImuReading& r : drive.imu(3.0)) ASSERT_TRUE(imu.add(r));
  Estimator estimator(Options{}, drive.T_BC(), 0.0);
  estimator.start(test::startAt(drive, 0.2, 3, 1.0));
  ASSERT_TRUE(estimator.process({1, drive.time(0.25), drive.see(0.25), {}, {}}, imu));
  estimator.state().nav.accel_bias.x() = std::nan("");
  const auto out = estimator.process({2, drive.time(0.3), drive.see(0.3), {}, {}}, imu);
  ASSERT_FALSE(out);
  EXPECT_TRUE(out.error().code.starts_with("numbers_")) << out.error().code;
  EXPECT_FALSE(estimator.started());
}

}  // namespace
}  // namespace perdure::vio
