#include "services/vio/core/start/initialiser.h"

#include <algorithm>
#include <cmath>

#include "common/math/so3.h"
#include "services/vio/core/update/updates.h"

namespace perdure::vio {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kGauge = 1e-4;        // rad, m; the start's yaw and position define W
constexpr double kMaxTurn = 0.3;       // rad/s; a larger mean rate at rest is a turn
constexpr double kSpeedWindow = 0.5;   // s; the force is averaged over this time
constexpr double kForceTolerance = 3;  // m/s², for the length of the mean force

/// Returns the mean dv/dt of the speeds in [from, to], in m/s²; 0 for fewer than two speeds.
double acceleration(const std::vector<SpeedSample>& speeds, TimePoint from, TimePoint to) {
  const SpeedSample *first = nullptr, *last = nullptr;
  for (const SpeedSample& s : speeds) {
    if (s.time < from - std::chrono::milliseconds(50) ||
        s.time > to + std::chrono::milliseconds(50)) {
      continue;
    }
    if (!first) first = &s;
    last = &s;
  }
  if (!first || first == last) return 0.0;
  return (last->speed - first->speed) / toSeconds(last->time - first->time);
}

}  // namespace

Eigen::Quaterniond levelAttitude(const Vector3d& up_B) {
  const Eigen::Quaterniond tilt = levelling(up_B.normalized());
  const double yaw = yawOf(tilt.toRotationMatrix());
  return (Eigen::Quaterniond(rotationAboutZ(-yaw)) * tilt).normalized();
}

Eigen::Matrix<double, 15, 15> startCovariance(const Nav& nav, double tilt, double gyro_bias,
                                              double accel_bias, const Vector3d& velocity_B) {
  const Matrix3d R = nav.q_WB.toRotationMatrix();
  Eigen::Matrix<double, 15, 15> P = Eigen::Matrix<double, 15, 15>::Zero();
  P.block<3, 3>(kTheta, kTheta) =
      R.transpose() * Vector3d(tilt * tilt, tilt * tilt, kGauge * kGauge).asDiagonal() * R;
  P.block<3, 3>(kPosition, kPosition) = kGauge * kGauge * Matrix3d::Identity();
  P.block<3, 3>(kVelocity, kVelocity) = R * velocity_B.cwiseAbs2().asDiagonal() * R.transpose();
  P.block<3, 3>(kGyroBias, kGyroBias) = gyro_bias * gyro_bias * Matrix3d::Identity();
  P.block<3, 3>(kAccelBias, kAccelBias) = accel_bias * accel_bias * Matrix3d::Identity();
  return P;
}

Result<Start> startAtRest(const ImuBuffer& imu, TimePoint now, const Options& options) {
  const StartOptions& o = options.start;
  const TimePoint from = now - durationFromSeconds(o.rest_window_s);
  if (imu.empty() || imu.first() > from + durationFromSeconds(0.02)) {
    return fail("start_window_short");
  }
  const auto readings = imu.between(from, now);
  const RestSample sample = restSample(readings, options.imu);
  if (std::abs(sample.force.norm() - options.gravity) > o.rest_accel_m_s2) {
    return fail("start_force_not_gravity");
  }
  if (sample.rate.norm() > kMaxTurn) return fail("start_turning");
  // Begins with a wide prior. The rest update then correlates tilt and accelerometer bias.
  State state({RigidTransform()}, 0.0, 1, 1);
  state.nav.q_WB = levelAttitude(sample.force);
  state.nav.gyro_bias = sample.rate;
  state.P().topLeftCorner<15, 15>() =
      startCovariance(state.nav, 0.3, kMaxTurn, o.accel_bias_sigma, Vector3d::Constant(0.1));
  if (const auto done = updateRest(state, sample, options.rest, options.gravity, false); !done) {
    return tl::unexpected(done.error());
  }
  return Start{now, state.nav, state.P().topLeftCorner<15, 15>(), true};
}

Result<Start> startWithSpeed(const ImuBuffer& imu, TimePoint now, const SpeedReading& speed,
                             const std::vector<SpeedSample>& speeds, const Options& options) {
  if (imu.empty() || imu.first() >= now || imu.last() < now) return fail("start_window_short");
  const TimePoint from = std::max(imu.first(), now - durationFromSeconds(kSpeedWindow));
  const auto readings = imu.between(from, now);
  const RestSample mean = restSample(readings, options.imu);
  // Force = acceleration − gravity. Subtracts dv/dt along x and the centripetal acceleration.
  const Vector3d motion(acceleration(speeds, from, now), 0, 0);
  const Vector3d up = mean.force - motion - mean.rate.cross(Vector3d(speed.speed, 0, 0));
  if (std::abs(up.norm() - options.gravity) > kForceTolerance) {
    return fail("start_force_not_gravity");
  }
  Start start;
  start.time = now;
  start.nav.q_WB = levelAttitude(up);
  start.nav.v_WB = start.nav.q_WB * Vector3d(speed.speed, 0, 0);
  const double lateral = std::min(options.start.velocity_sigma, 0.1 + 0.1 * std::abs(speed.speed));
  start.covariance = startCovariance(start.nav, options.start.tilt_sigma,
                                     options.start.gyro_bias_sigma, options.start.accel_bias_sigma,
                                     Vector3d(speed.sigma + 0.05, lateral, lateral));
  return start;
}

}  // namespace perdure::vio
