// Tests a camera whose rows are exposed in sequence: the motion within an image, its Jacobians, the
// read-out time as a part of the state, and the errors of a filter that ignores it.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>

#include "common/math/chi2.h"
#include "common/math/numeric_jacobian.h"
#include "common/math/so3.h"
#include "services/vio/core/estimator.h"
#include "services/vio/core/propagation/imu_propagator.h"
#include "services/vio/core/start/motion_initialiser.h"
#include "services/vio/core/update/triangulation.h"
#include "services/vio/core/update/visual.h"
#include "tests/services/vio/simulated_drive.h"

namespace perdure::vio {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kReadout = 0.02;

RowMotion someRows() {
  RowMotion m;
  m.rate = {0.7, -1.2, 0.5};
  m.rate_change = {8.0, 3.0, -11.0};
  m.velocity = {1.4, -0.6, 0.3};
  m.acceleration = {3.0, -5.0, 2.0};
  return m;
}

test::DriveOptions rollingDrive(unsigned seed) {
  test::DriveOptions o;
  o.seed = seed;
  o.readout_s = kReadout;
  return o;
}

ImuBuffer samples(test::SimulatedDrive& drive, double until) {
  ImuBuffer imu;
  for (const ImuReading& r : drive.imu(until)) EXPECT_TRUE(imu.add(r));
  return imu;
}

TEST(RowMotion, IsThatOfTheBodyBetweenTheRows) {
  test::DriveOptions options;
  options.noise.gyro = options.noise.accel = 0.0;
  test::SimulatedDrive drive(options);
  const ImuBuffer imu = samples(drive, 4.0);
  std::vector<ImuReading> readings;
  for (double t = 0.5; t < 3.5; t += 0.137) {
    const Nav nav = drive.truth(t);
    const Duration half = durationFromSeconds(0.5 * kReadout);
    const RowMotion m = rowMotion(nav, imu, drive.time(t), half, 9.81, readings);
    for (const double s : {-0.01, -0.004, 0.006, 0.01}) {
      const RigidTransform T_WC = nav.T_WB() * rowCamera(m, drive.T_BC()[0], s).T_BC;
      const RigidTransform truth = drive.truth(t + s).T_WB() * drive.T_BC()[0];
      EXPECT_LT(logSo3(truth.q.conjugate() * T_WC.q).norm(), 2e-5) << t << ' ' << s;
      EXPECT_LT((T_WC.p - truth.p).norm(), 2e-5) << t << ' ' << s;
    }
  }
}

TEST(RowCamera, ItsDerivativeByTimeAgreesWithTheNumericOne) {
  const RigidTransform T_BC = test::testCamera(0).T_BC;
  for (const double s : {-0.03, 0.0, 0.02}) {
    const RowCamera row = rowCamera(someRows(), T_BC, s);
    const auto f = [&](const VectorXd& d) -> VectorXd {
      return boxMinus(rowCamera(someRows(), T_BC, s + d[0]).T_BC, row.T_BC);
    };
    Eigen::Matrix<double, 6, 1> analytic;
    analytic << row.theta_dot, row.p_dot;
    EXPECT_LT((numericJacobian(f, VectorXd::Zero(1)) - analytic).cwiseAbs().maxCoeff(), 1e-7);
  }
}

/// One clone of a rolling-shutter camera, and a point in the lower part of its image.
struct OneView {
  State state;
  ImagePoint seen;
  Vector3d p_W;

  OneView() : state({test::testCamera(0).T_BC}, 0.0, 3, 3, {kReadout}, {.readout = true}) {
    state.nav.q_WB = expQuaternion(Vector3d(0.1, 0.2, -0.4));
    state.nav.p_WB = {0.5, 1, -0.2};
    state.nav_linear = state.nav;
    state.addClone(1, fromNanoseconds(0), Vector3d::Zero(), true);
    state.clones.back().rows = someRows();
    p_W = (state.clones.back().T_WB * state.T_BC[0]) * Vector3d(0.7, 0.9, 3.1);
    seen = *imagePoint(CameraModel(test::testCamera(0)), Vector2d(470, 390));
  }
  View view() const {
    const Clone& clone = state.clones.back();
    return *viewOf(state, clone, 0, seen, p_W, p_W, 0.4);
  }
};

TEST(RollingView, JacobiansAgreeWithNumericOnes) {
  const OneView one;
  EXPECT_GT(one.seen.row, 0.3);
  const auto f = [&](const VectorXd& d) -> VectorXd {
    OneView moved = one;
    Clone& clone = moved.state.clones.back();
    clone.T_WB = boxPlus(clone.T_WB, d.head<6>());
    moved.state.T_BC[0] = boxPlus(moved.state.T_BC[0], d.segment<6>(6));
    moved.state.readout_s[0] += d[12];
    moved.p_W += d.tail<3>();
    return moved.view().r;
  };
  const View view = one.view();
  Eigen::MatrixXd analytic(2, 16);
  analytic << view.J.pose, view.J.extrinsic, view.readout, view.J.point;
  // The residual is the observation minus the prediction.
  const Eigen::MatrixXd numeric = -numericJacobian(f, VectorXd::Zero(16));
  EXPECT_LT((numeric - analytic).cwiseAbs().maxCoeff(), 1e-4 * analytic.cwiseAbs().maxCoeff());
  EXPECT_LT((numeric - analytic).col(12).norm(), 1e-5 * analytic.col(12).norm());
  EXPECT_GT(analytic.col(12).norm(), 100.0) << "pixels for a second, in deviations";
}

TEST(RollingView, YawAndPositionOfTheWorldStayUnobservable) {
  const OneView one;
  const View view = one.view();
  const RigidTransform& T_WB = one.state.clones.back().linear;
  Eigen::Matrix<double, 6, 4> of_pose = Eigen::Matrix<double, 6, 4>::Zero();
  of_pose.topLeftCorner<3, 1>() = T_WB.R().transpose() * Vector3d::UnitZ();
  of_pose.bottomLeftCorner<3, 1>() = Vector3d::UnitZ().cross(T_WB.p);
  of_pose.bottomRightCorner<3, 3>().setIdentity();
  Eigen::Matrix<double, 3, 4> of_point;
  of_point << Vector3d::UnitZ().cross(one.p_W), Eigen::Matrix3d::Identity();
  EXPECT_LT((view.J.pose * of_pose + view.J.point * of_point).norm(), 1e-9 * view.J.point.norm());
}

TEST(RollingView, TheStackedViewsHaveTheSameColumnsAsTheSingleOne) {
  OneView one;
  one.state.addClone(2, fromNanoseconds(1), Vector3d::Zero(), true);
  one.state.clones.back().rows = someRows();
  const Track track{7, {{1, {one.seen, {}}}, {2, {one.seen, {}}}}};
  const PointSystem s = stackViews(track, one.state, one.p_W, 0.4);
  const std::vector<Block> blocks = calibrationAndClones(one.state);
  ASSERT_EQ(blocks.size(), 3u);
  EXPECT_EQ(blocks[0].at + 6, *one.state.readoutAt(0));
  ASSERT_EQ(s.H_x.cols(), 6 + 1 + 12);
  const View view = *viewOf(one.state, one.state.clones[0], 0, one.seen, one.p_W, one.p_W, 0.4);
  Eigen::MatrixXd expected(2, 19);
  expected << view.J.extrinsic, view.readout, view.J.pose, Eigen::MatrixXd::Zero(2, 6);
  EXPECT_LT((s.H_x.topRows<2>() - expected).norm(), 1e-12 * expected.norm());
}

TEST(RollingState, ReadOutsThatAreNotEstimatedOrZeroAreNotInTheError) {
  const std::vector<RigidTransform> T_BC(2);
  EXPECT_EQ(State(T_BC, 0.0, 3, 3).size(), kNavSize + 13);
  EXPECT_EQ(State(T_BC, 0.0, 3, 3, {kReadout, kReadout}).size(), kNavSize + 13);
  const State second(T_BC, 0.0, 3, 3, {0.0, kReadout}, {.readout = true});
  EXPECT_EQ(second.size(), kNavSize + 14);
  EXPECT_FALSE(second.readoutAt(0));
  EXPECT_EQ(second.readoutAt(1), second.timeOffsetAt() - 1);
}

TEST(RollingState, ComesBackOnlyToTheSameShutter) {
  test::SimulatedDrive drive(rollingDrive(1));
  Estimator rolling(Options{}, drive.T_BC(), 0.0, {kReadout}), global(Options{}, drive.T_BC(), 0.0);
  rolling.start(test::startAt(drive, 0.2, 1, 1.0));
  rolling.state().readout_s[0] = 0.0187;
  const SavedState saved = rolling.save();
  ASSERT_FALSE(global.fits(saved));
  EXPECT_EQ(global.fits(saved).error().code, "state_other_shutter");
  ASSERT_TRUE(rolling.fits(saved));
  rolling.restore(saved);
  EXPECT_EQ(rolling.state().readout_s[0], 0.0187);
  EXPECT_EQ(rolling.save().covariance, saved.covariance);
}

struct RollingRun {
  double readout_error = 0.0, readout_nees = 0.0;  ///< errors at the end
  double pose_nees = 0.0;                          ///< mean over the frames, of [θ, p]
  double position_rms = 0.0;
};

/// Runs a drive of a camera with `readout_s`, and a filter that is configured with `told`.
RollingRun roll(unsigned seed, double told, const Options& options, double seconds,
                double readout_s = kReadout) {
  test::DriveOptions drive_options = rollingDrive(seed);
  drive_options.readout_s = readout_s;
  drive_options.walking_biases = true;
  test::SimulatedDrive drive(drive_options);
  const ImuBuffer imu = samples(drive, seconds + 1.0);
  Estimator estimator(options, drive.T_BC(), 0.0, {told});
  estimator.start(test::startAt(drive, 0.2, seed, 1.0));
  RollingRun run;
  int frames = 0;
  for (double t = 0.25; t < seconds; t += 0.05) {
    const auto out = estimator.process(
        {static_cast<std::uint64_t>(++frames), drive.time(t), drive.see(t), {}, {}}, imu);
    EXPECT_TRUE(out) << out.error().code;
    if (!out) return run;
    const Nav truth = drive.truth(t);
    Eigen::Matrix<double, 6, 1> e;
    e << logSo3(out->nav.q_WB.conjugate() * truth.q_WB), truth.p_WB - out->nav.p_WB;
    run.pose_nees += e.dot(out->covariance.topLeftCorner<6, 6>().ldlt().solve(e));
    run.position_rms += e.tail<3>().squaredNorm();
  }
  run.pose_nees /= frames;
  run.position_rms = std::sqrt(run.position_rms / frames);
  const State& state = estimator.state();
  run.readout_error = state.readout_s[0] - readout_s;
  if (const auto at = state.readoutAt(0)) {
    run.readout_nees = run.readout_error * run.readout_error / state.P()(*at, *at);
  }
  return run;
}

TEST(RollingShutter, TheReadOutIsFoundToAMillisecond) {
  Options options;
  options.calibration.readout_s = 0.005;
  for (const double told : {0.015, 0.025}) {
    for (unsigned seed = 1; seed <= 2; ++seed) {
      const RollingRun run = roll(seed, told, options, 30.0);
      std::printf("told %.0f ms: off by %.2f ms, NEES %.2f; position %.3f m\n", 1e3 * told,
                  1e3 * run.readout_error, run.readout_nees, run.position_rms);
      EXPECT_LT(std::abs(run.readout_error), 0.001) << told << ' ' << seed;
    }
  }
}

TEST(LongRollingShutter, ErrorsLieInTheBandOfTheirCovarianceOverSeededRuns) {
  constexpr int kRuns = 12;
  Options options;
  options.calibration.estimate_extrinsics = options.calibration.estimate_time_offset = false;
  options.calibration.readout_s = 0.002;
  std::mt19937 random(17);
  std::normal_distribution<double> normal(kReadout, options.calibration.readout_s);
  double pose = 0.0, readout = 0.0;
  for (unsigned seed = 1; seed <= kRuns; ++seed) {
    const RollingRun run = roll(seed, normal(random), options, 10.0);
    pose += run.pose_nees;
    readout += run.readout_nees;
  }
  std::printf("NEES: pose %.2f of 6, read-out %.2f of 1\n", pose / kRuns, readout / kRuns);
  EXPECT_GT(pose, chi2Quantile(0.005, 6 * kRuns));
  EXPECT_LT(pose, chi2Quantile(0.995, 6 * kRuns));
  EXPECT_GT(readout, chi2Quantile(0.005, kRuns));
  EXPECT_LT(readout, chi2Quantile(0.995, kRuns));
}

TEST(RollingShutter, AFilterThatDoesNotKnowOfItIsWorse) {
  double known = 0.0, unknown = 0.0, found = 0.0;
  Options fixed;
  fixed.calibration.estimate_readout = false;
  for (unsigned seed = 1; seed <= 3; ++seed) {
    known += roll(seed, kReadout, fixed, 12.0).position_rms / 3.0;
    unknown += roll(seed, 0.0, fixed, 12.0).position_rms / 3.0;
    found += roll(seed, kReadout, Options{}, 12.0).position_rms / 3.0;
  }
  std::printf("position: given %.3f m, given and estimated %.3f m, not known %.3f m\n", known,
              found, unknown);
  EXPECT_GT(unknown, 2.0 * known);
  EXPECT_LT(found, 1.3 * known);
}

TEST(LongRollingShutter, IsAsGoodAsAGlobalOne) {
  constexpr int kRuns = 24;
  RollingRun rolling, global;
  for (unsigned seed = 1; seed <= kRuns; ++seed) {
    const RollingRun r = roll(seed, kReadout, Options{}, 20.0);
    const RollingRun g = roll(seed, 0.0, Options{}, 20.0, 0.0);
    rolling.position_rms += r.position_rms / kRuns, rolling.pose_nees += r.pose_nees / kRuns;
    global.position_rms += g.position_rms / kRuns, global.pose_nees += g.pose_nees / kRuns;
  }
  std::printf("rolling %.4f m, NEES %.2f of 6; global %.4f m, NEES %.2f of 6\n",
              rolling.position_rms, rolling.pose_nees, global.position_rms, global.pose_nees);
  EXPECT_LT(rolling.position_rms, 1.15 * global.position_rms);
  EXPECT_LT(rolling.pose_nees, 1.2 * global.pose_nees);
}

/// Mean errors of starts in motion with the configured read-out time `told`: velocity in B in m/s,
/// gyroscope bias in rad/s.
struct RollingStart {
  int started = 0;
  double velocity = 0.0, velocity_nees = 0.0, gyro_bias = 0.0;  ///< means
};

RollingStart startRolling(double told, double pixel_sigma) {
  RollingStart result;
  Options how;
  how.vision.sigma_px = std::max(pixel_sigma, 0.1);
  for (unsigned seed = 1; seed <= 6; ++seed) {
    test::DriveOptions options = rollingDrive(seed);
    options.gyro_bias = {0.05, -0.03, 0.06};
    options.pixel_sigma = pixel_sigma;
    test::SimulatedDrive drive(options);
    const double at = 2.0 + seed;
    const ImuBuffer imu = samples(drive, at + 0.1);
    CameraCalibration camera = drive.cameras()[0].calibration();
    camera.readout_s = told;
    MotionInitialiser initialiser{how};
    std::uint64_t frame = 0;
    for (double t = at - 1.2; t < at + 1e-6; t += 0.05) {
      initialiser.add({++frame, drive.time(t), drive.see(t), {}, {}}, drive.time(t));
    }
    const auto start = initialiser.start(imu, {CameraModel(camera)});
    if (!start) continue;
    const Nav truth = drive.truth(at);
    const Vector3d e =
        start->nav.q_WB.conjugate() * start->nav.v_WB - truth.q_WB.conjugate() * truth.v_WB;
    const Eigen::Matrix3d R = start->nav.q_WB.toRotationMatrix();
    const Eigen::Matrix3d P = R.transpose() * start->covariance.block<3, 3>(6, 6) * R;
    ++result.started;
    result.velocity += e.norm();
    result.velocity_nees += e.dot(P.ldlt().solve(e)) / 3.0;
    result.gyro_bias += (start->nav.gyro_bias - truth.gyro_bias).norm();
  }
  const double n = std::max(1, result.started);
  result.velocity /= n, result.velocity_nees /= n, result.gyro_bias /= n;
  return result;
}

void print(const RollingStart& s) {
  std::printf("%d starts, velocity %.4f m/s, NEES %.2f of 1, gyroscope bias %.4f rad/s\n",
              s.started, s.velocity, s.velocity_nees, s.gyro_bias);
}

TEST(RollingStart, InMotionIsAsGoodAsItsCovarianceSays) {
  const RollingStart start = startRolling(kReadout, 0.4);
  print(start);
  EXPECT_GE(start.started, 3);
  EXPECT_LT(start.velocity_nees, chi2Quantile(0.995, 3 * start.started) / (3 * start.started));
  EXPECT_LT(start.gyro_bias, 0.02);
}

// Within a second, a point hardly changes its row. The effect of the rows then resembles another
// position of the point, and is visible only with exact pixels.
TEST(RollingStart, WhoDoesNotKnowOfItStartsWorse) {
  const RollingStart known = startRolling(kReadout, 0.05), unknown = startRolling(0.0, 0.05);
  print(known);
  print(unknown);
  EXPECT_GE(known.started, 3);
  EXPECT_GE(unknown.started, 3);
  EXPECT_GT(unknown.velocity, 1.2 * known.velocity);
  EXPECT_GT(unknown.gyro_bias, 2.0 * known.gyro_bias);
}

}  // namespace
}  // namespace perdure::vio
