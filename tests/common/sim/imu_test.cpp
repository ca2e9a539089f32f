#include "common/sim/imu.h"

#include <gtest/gtest.h>

#include "common/math/so3.h"

namespace perdure::sim {
namespace {

constexpr TimePoint kStart = fromNanoseconds(1'000'000'000'000);
const ImuCalibration kCalibration{2e-3, 3e-4, 2e-2, 5e-3, 200.0};

struct Reckoned {
  Eigen::Quaterniond q;
  Eigen::Vector3d p, v;
};

/// Integrates by the classical Runge-Kutta method over two sample intervals; the sample between
/// them is the midpoint.
Reckoned integrate(const std::vector<ImuRecord>& imu, Reckoned state) {
  const Eigen::Vector3d gravity(0, 0, -kGravity);
  for (std::size_t i = 0; i + 2 < imu.size(); i += 2) {
    const ImuSample &a = imu[i].sample, &b = imu[i + 1].sample, &c = imu[i + 2].sample;
    const double h = toSeconds(c.time - a.time);
    // The rotation within the step: Magnus series up to the fourth order.
    const Eigen::Vector3d mean = (a.gyro + 4.0 * b.gyro + c.gyro) / 6.0;
    const Eigen::Vector3d turn = h * mean + h * h / 12.0 * a.gyro.cross(c.gyro);
    const Eigen::Vector3d half = h / 24.0 * (5.0 * a.gyro + 8.0 * b.gyro - c.gyro);
    const Eigen::Vector3d f0 = state.q * a.accel + gravity;
    const Eigen::Vector3d f1 = state.q * (expQuaternion(half) * b.accel) + gravity;
    const Eigen::Vector3d f2 = state.q * (expQuaternion(turn) * c.accel) + gravity;
    state.p += h * state.v + h * h / 6.0 * (f0 + 2.0 * f1);
    state.v += h / 6.0 * (f0 + 4.0 * f1 + f2);
    state.q = (state.q * expQuaternion(turn)).normalized();
  }
  return state;
}

std::vector<ImuRecord> record(const Scene& scene, double seconds) {
  return simulateImu(scene.body, *scene.rig.calibration.imu, scene.rig.imu, scene.seed, seconds,
                     kStart);
}

TEST(Imu, WithoutNoiseLeadsBackToTheTruthWithinAMillimetre) {
  for (const char* name : {"street", "room"}) {
    SceneOptions options;
    options.noise = false;
    const Scene scene = makeScene(name, 7, options);
    const auto imu = record(scene, 20.0);
    ASSERT_EQ(imu.size(), 4001u);
    const MotionState start = scene.body.at(0.0), end = scene.body.at(20.0);
    const Reckoned reckoned = integrate(imu, {start.T_WB.q, start.T_WB.p, start.velocity_W});
    EXPECT_GT(scene.body.at(10.0).velocity_W.norm(), 0.3) << name;
    EXPECT_LT((reckoned.p - end.T_WB.p).norm(), 1e-3) << name;
    EXPECT_LT(logSo3(reckoned.q.conjugate() * end.T_WB.q).norm(), 1e-5) << name;
  }
}

TEST(Imu, AtRestFeelsGravityOnly) {
  ImuErrors errors;
  errors.noise = false;
  const auto imu = simulateImu(Trajectory(RigidTransform{}), kCalibration, errors, 1, 0.1, kStart);
  ASSERT_EQ(imu.size(), 21u);
  EXPECT_EQ(imu[3].sample.accel, Eigen::Vector3d(0, 0, kGravity));
  EXPECT_EQ(imu[3].sample.gyro, Eigen::Vector3d::Zero());
  EXPECT_EQ(imu[3].sample.sequence, 3u);
  EXPECT_EQ(toNanoseconds(imu[3].sample.time), 1'000'015'000'000);
}

TEST(Imu, NoiseHasTheDensitiesOfItsCalibration) {
  const auto imu =
      simulateImu(Trajectory(RigidTransform{}), kCalibration, ImuErrors{}, 3, 500.0, kStart);
  const double n = static_cast<double>(imu.size()), rate = kCalibration.rate_hz;
  Eigen::Vector3d gyro = Eigen::Vector3d::Zero(), accel = gyro, gyro_walk = gyro, accel_walk = gyro;
  for (std::size_t i = 0; i < imu.size(); ++i) {
    gyro += (imu[i].sample.gyro - imu[i].gyro_bias).cwiseAbs2() / n;
    accel +=
        (imu[i].sample.accel - imu[i].accel_bias - Eigen::Vector3d(0, 0, kGravity)).cwiseAbs2() / n;
    if (i == 0) continue;
    gyro_walk += (imu[i].gyro_bias - imu[i - 1].gyro_bias).cwiseAbs2() / (n - 1);
    accel_walk += (imu[i].accel_bias - imu[i - 1].accel_bias).cwiseAbs2() / (n - 1);
  }
  // The variance of 1e5 samples has an uncertainty of 0.45 %; 3 % is more than six standard
  // deviations.
  const auto near = [](const Eigen::Vector3d& variance, double density, double factor) {
    for (Eigen::Index i = 0; i < 3; ++i) {
      EXPECT_NEAR(variance[i] / (density * density * factor), 1.0, 0.03);
    }
  };
  near(gyro, kCalibration.gyro_noise, rate);
  near(accel, kCalibration.accel_noise, rate);
  near(gyro_walk, kCalibration.gyro_bias_walk, 1.0 / rate);
  near(accel_walk, kCalibration.accel_bias_walk, 1.0 / rate);
}

/// The Allan deviation over one second equals the density of the white noise at any rate.
TEST(Imu, AllanDeviationAtOneSecondIsTheDensityAtAnyRate) {
  for (const double rate : {100.0, 400.0}) {
    ImuCalibration calibration{2e-3, 0.0, 2e-2, 0.0, rate};
    const auto imu =
        simulateImu(Trajectory(RigidTransform{}), calibration, ImuErrors{}, 5, 2000.0, kStart);
    const auto per_second = static_cast<std::size_t>(rate);
    double sum = 0.0, last = 0.0;
    for (std::size_t second = 0; second < 2000; ++second) {
      double mean = 0.0;
      for (std::size_t i = 0; i < per_second; ++i) {
        mean += imu[second * per_second + i].sample.gyro.x() / rate;
      }
      if (second > 0) sum += 0.5 * (mean - last) * (mean - last) / 1999.0;
      last = mean;
    }
    EXPECT_NEAR(std::sqrt(sum) / calibration.gyro_noise, 1.0, 0.1) << rate;
  }
}

TEST(Imu, ScalesMisalignsAndSaturates) {
  ImuErrors errors;
  errors.noise = false;
  errors.accel_scale << 1, 0, 0.02, 0, 1, 0, 0, 0, 1.01;
  errors.accel_bias = {0, 0.5, 0};
  const Trajectory still{RigidTransform{}};
  EXPECT_TRUE(simulateImu(still, kCalibration, errors, 1, 0.0, kStart)[0].sample.accel.isApprox(
      Eigen::Vector3d(0.02 * kGravity, 0.5, 1.01 * kGravity)));
  errors.accel_limit = 5.0;
  EXPECT_EQ(simulateImu(still, kCalibration, errors, 1, 0.0, kStart)[0].sample.accel.z(), 5.0);
}

TEST(Imu, APrefixIsTheSameAndAnotherSeedIsNot) {
  const Scene scene = makeScene("street", 7, {});
  const auto whole = record(scene, 5.0), part = record(scene, 2.0);
  ASSERT_LT(part.size(), whole.size());
  for (std::size_t i = 0; i < part.size(); ++i) {
    EXPECT_EQ(part[i].sample.gyro, whole[i].sample.gyro);
    EXPECT_EQ(part[i].sample.accel, whole[i].sample.accel);
  }
  const auto other =
      simulateImu(scene.body, *scene.rig.calibration.imu, scene.rig.imu, 8, 1.0, kStart);
  EXPECT_NE(other[5].sample.gyro, whole[5].sample.gyro);
}

TEST(Speed, IsTheBodysOwnAlongItsAxisWithItsDeviation) {
  const Scene scene = makeScene("street", 7, {});
  ASSERT_TRUE(scene.rig.speed);
  const auto samples = simulateSpeed(scene.body, *scene.rig.speed, 7, 60.0, kStart);
  ASSERT_EQ(samples.size(), 3001u);
  double sum = 0.0;
  for (const SpeedSample& sample : samples) {
    const MotionState state = scene.body.at(toSeconds(sample.time - kStart));
    // A vehicle does not skid, so that its velocity is parallel to its axis.
    EXPECT_NEAR(state.velocity_W.norm(), state.velocity_W.dot(state.T_WB.R().col(0)), 0.05);
    const double error = sample.speed - state.velocity_W.dot(state.T_WB.R().col(0));
    sum += error * error / 3001.0;
    EXPECT_EQ(sample.sigma, scene.rig.speed->sigma);
  }
  EXPECT_NEAR(std::sqrt(sum) / scene.rig.speed->sigma, 1.0, 0.08);
}

}  // namespace
}  // namespace perdure::sim
