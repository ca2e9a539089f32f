#include "services/vio/core/start/initialiser.h"

#include <gtest/gtest.h>

#include <optional>

#include "common/math/so3.h"
#include "services/vio/core/start/motion_initialiser.h"
#include "tests/services/vio/simulated_drive.h"

namespace perdure::vio {
namespace {

using Eigen::Vector3d;

ImuBuffer bufferOf(const std::vector<ImuReading>& readings) {
  ImuBuffer buffer;
  for (const ImuReading& r : readings) EXPECT_TRUE(buffer.add(r));
  return buffer;
}

double tiltError(const Nav& estimate, const Nav& truth) {
  const Vector3d a = estimate.q_WB.conjugate() * Vector3d::UnitZ();
  const Vector3d b = truth.q_WB.conjugate() * Vector3d::UnitZ();
  return std::acos(std::min(1.0, a.dot(b)));
}

TEST(StartAtRest, FindsGravityAndGyroBias) {
  test::DriveOptions options;
  options.rest_s = 5.0;
  options.accel_bias.setZero();
  test::SimulatedDrive drive(options);
  const auto start = startAtRest(bufferOf(drive.imu(1.0)), drive.time(0.9), Options{});
  ASSERT_TRUE(start) << start.error().code;
  EXPECT_LT(tiltError(start->nav, drive.truth(0.9)), 0.005);
  EXPECT_LT((start->nav.gyro_bias - options.gyro_bias).norm(), 0.003);
  EXPECT_NEAR(yawOf(start->nav.q_WB.toRotationMatrix()), 0.0, 0.01);
  EXPECT_LT(start->nav.p_WB.norm(), 1e-9);
}

TEST(StartAtRest, TiltAndAccelerometerBiasAreCorrelated) {
  test::DriveOptions options;
  options.rest_s = 5.0;
  test::SimulatedDrive drive(options);
  const auto start = startAtRest(bufferOf(drive.imu(1.0)), drive.time(0.9), Options{});
  ASSERT_TRUE(start);
  // The remaining uncertainty is the tilt that a horizontal bias would cause: σ_b / g.
  const double tilt = std::sqrt(start->covariance(0, 0));
  EXPECT_NEAR(tilt, Options{}.start.accel_bias_sigma / 9.81, 0.003);
  EXPECT_GT(std::abs(start->covariance(0, kAccelBias + 1)),
            0.8 * tilt * std::sqrt(start->covariance(kAccelBias + 1, kAccelBias + 1)));
}

TEST(StartAtRest, RefusesAShortWindowAFallAndATurn) {
  test::DriveOptions options;
  options.rest_s = 5.0;
  test::SimulatedDrive drive(options);
  auto readings = drive.imu(1.0);
  EXPECT_EQ(startAtRest(bufferOf(readings), drive.time(0.2), Options{}).error().code,
            "start_window_short");
  auto turning = readings;
  for (ImuReading& r : turning) r.gyro.z() += 0.6;
  EXPECT_EQ(startAtRest(bufferOf(turning), drive.time(0.9), Options{}).error().code,
            "start_turning");
  for (ImuReading& r : readings) r.accel *= 0.5;
  EXPECT_EQ(startAtRest(bufferOf(readings), drive.time(0.9), Options{}).error().code,
            "start_force_not_gravity");
}

TEST(StartWithSpeed, LevelsInSpiteOfAccelerationAndTurn) {
  // 8 m/s, with an acceleration of 2 m/s² and a yaw rate of 0.4 rad/s on a level street.
  std::vector<ImuReading> readings;
  std::vector<SpeedSample> speeds;
  for (int i = 0; i <= 20; ++i) {
    const double t = 0.05 * i, v = 8.0 + 2.0 * t;
    const TimePoint time = fromNanoseconds(0) + durationFromSeconds(t);
    readings.push_back({time, Vector3d(0, 0, 0.4), Vector3d(2.0, 0.4 * v, 9.81)});
    speeds.push_back({.time = time, .speed = v, .sigma = 0.1});
  }
  const auto start =
      startWithSpeed(bufferOf(readings), readings.back().time, {10.0, 0.1}, speeds, Options{});
  ASSERT_TRUE(start) << start.error().code;
  EXPECT_LT(std::acos((start->nav.q_WB * Vector3d::UnitZ()).z()), 0.05);
  EXPECT_NEAR(start->nav.v_WB.norm(), 10.0, 1e-9);
}

Result<Start> motionStart(bool stereo, unsigned seed, double at, Nav& truth) {
  test::DriveOptions options;
  options.seed = seed;
  options.stereo = stereo;
  options.gyro_bias = {0.05, -0.03, 0.06};
  test::SimulatedDrive drive(options);
  const ImuBuffer imu = bufferOf(drive.imu(at + 0.1));
  MotionInitialiser initialiser{Options{}};
  std::uint64_t frame = 0;
  for (double t = at - 1.2; t < at + 1e-6; t += 0.05) {
    initialiser.add({++frame, drive.time(t), drive.see(t), {}, {}}, drive.time(t));
    truth = drive.truth(t);
  }
  return initialiser.start(imu, drive.cameras());
}

TEST(MotionStart, FindsVelocityGravityAndGyroBiasWithOneCamera) {
  int good = 0;
  for (unsigned seed = 1; seed <= 5; ++seed) {
    Nav truth;
    const auto start = motionStart(false, seed, 2.0 + seed, truth);
    if (!start) continue;
    const Vector3d v_B = start->nav.q_WB.conjugate() * start->nav.v_WB;
    const Vector3d v_B_truth = truth.q_WB.conjugate() * truth.v_WB;
    EXPECT_LT((start->nav.gyro_bias - truth.gyro_bias).norm(), 0.02) << seed;
    EXPECT_LT(tiltError(start->nav, truth), 0.05) << seed;
    const double sigma = std::sqrt(start->covariance.block<3, 3>(6, 6).trace());
    EXPECT_LT((v_B - v_B_truth).norm(), 3.0 * sigma) << seed;
    ++good;
  }
  EXPECT_GE(good, 2) << "the others say that they do not know";
}

TEST(MotionStart, FindsVelocityWithTwoCameras) {
  Nav truth;
  const auto start = motionStart(true, 2, 3.0, truth);
  ASSERT_TRUE(start) << start.error().code;
  const Vector3d v_B = start->nav.q_WB.conjugate() * start->nav.v_WB;
  EXPECT_LT((v_B - truth.q_WB.conjugate() * truth.v_WB).norm(), 0.15);
}

/// A start from 2 s on; the body rotates and its speed changes all the time.
struct RoomStart {
  test::SimulatedDrive drive{{}};
  ImuBuffer imu;
  MotionInitialiser initialiser{Options{}};
  std::uint64_t frame = 0;

  void addSamples(double from, double force_scale = 1.0) {
    for (ImuReading r : drive.imu(5.0)) {
      r.accel *= force_scale;
      if (r.time < drive.time(from)) continue;
      EXPECT_TRUE(imu.add(r));
    }
  }
  void addFrame(double t) {
    initialiser.add({++frame, drive.time(t), drive.see(t), {}, {}}, drive.time(t));
  }
  /// Returns the time of the first start from `from` on; nothing if there is none before `until`.
  std::optional<double> startsAt(double from, double until) {
    for (double t = from; t < until; t += 0.05) {
      addFrame(t);
      if (initialiser.start(imu, drive.cameras())) return t;
    }
    return std::nullopt;
  }
};

TEST(MotionStart, FramesFromBeforeTheSamplesDoNotHoldItUp) {
  RoomStart room;
  room.addSamples(2.03);
  const auto at = room.startsAt(2.0, 5.0);
  ASSERT_TRUE(at);
  EXPECT_LT(*at, 3.5) << "not a whole window later";
}

TEST(MotionStart, ANewRunOfTheClockIsAnotherWindow) {
  RoomStart room;
  room.addSamples(1.9);
  for (double t = 2.5; t < 3.0; t += 0.05) room.addFrame(t);
  ASSERT_FALSE(room.startsAt(2.0, 2.1));
  EXPECT_TRUE(room.startsAt(2.1, 4.5));
}

TEST(MotionStart, RefusesSamplesInAnotherUnit) {
  for (const double scale : {1.0 / 9.81, 0.38, 2.0}) {
    RoomStart room;
    room.addSamples(1.9, scale);
    EXPECT_FALSE(room.startsAt(2.0, 4.5)) << scale;
    EXPECT_EQ(room.initialiser.start(room.imu, room.drive.cameras()).error().code,
              "start_force_not_gravity");
  }
}

TEST(MotionStart, WaitsForItsWindow) {
  test::SimulatedDrive drive({});
  MotionInitialiser initialiser{Options{}};
  initialiser.add({1, drive.time(0.5), drive.see(0.5), {}, {}}, drive.time(0.5));
  EXPECT_EQ(initialiser.start(bufferOf(drive.imu(1.0)), drive.cameras()).error().code,
            "start_window_short");
}

}  // namespace
}  // namespace perdure::vio
