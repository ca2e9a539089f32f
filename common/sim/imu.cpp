#include "common/sim/imu.h"

#include <cmath>

#include "common/base/check.h"
#include "common/sim/dice.h"

namespace perdure::sim {
namespace {

Eigen::Vector3d normal3(Dice& dice) {
  const double x = dice.normal(), y = dice.normal(), z = dice.normal();
  return {x, y, z};
}

Eigen::Vector3d saturated(const Eigen::Vector3d& value, double limit) {
  return value.cwiseMax(-limit).cwiseMin(limit);
}

}  // namespace

std::vector<ImuRecord> simulateImu(const Trajectory& body, const ImuCalibration& calibration,
                                   const ImuErrors& errors, std::uint64_t seed, double seconds,
                                   TimePoint epoch) {
  check(calibration.rate_hz > 0.0, "an IMU has a rate");
  Dice dice(seedOf("imu", {seed}));
  const double on = errors.noise ? 1.0 : 0.0;
  const double white = on * std::sqrt(calibration.rate_hz);
  const double walk = on / std::sqrt(calibration.rate_hz);
  Eigen::Vector3d gyro_bias = errors.gyro_bias, accel_bias = errors.accel_bias;
  std::vector<ImuRecord> records;
  for (std::uint64_t i = 0;; ++i) {
    const Duration since = durationFromSeconds(static_cast<double>(i) / calibration.rate_hz);
    const double t_s = toSeconds(since);
    if (since > durationFromSeconds(seconds)) return records;
    const MotionState state = body.at(t_s);
    const Eigen::Vector3d force =
        state.T_WB.q.conjugate() * (state.acceleration_W + Eigen::Vector3d(0, 0, kGravity));
    ImuRecord record{{0, i, epoch + since, {}, {}}, gyro_bias, accel_bias};
    record.sample.gyro = saturated(errors.gyro_scale * state.angular_velocity_B + gyro_bias +
                                       white * calibration.gyro_noise * normal3(dice),
                                   errors.gyro_limit);
    record.sample.accel = saturated(
        errors.accel_scale * force + accel_bias + white * calibration.accel_noise * normal3(dice),
        errors.accel_limit);
    records.push_back(record);
    gyro_bias += walk * calibration.gyro_bias_walk * normal3(dice);
    accel_bias += walk * calibration.accel_bias_walk * normal3(dice);
  }
}

std::vector<SpeedSample> simulateSpeed(const Trajectory& body, const SpeedErrors& errors,
                                       std::uint64_t seed, double seconds, TimePoint epoch) {
  check(errors.rate_hz > 0.0 && errors.sigma > 0.0, "a speed has a rate and a deviation");
  Dice dice(seedOf("speed", {seed}));
  std::vector<SpeedSample> samples;
  for (std::uint64_t i = 0;; ++i) {
    const Duration since = durationFromSeconds(static_cast<double>(i) / errors.rate_hz);
    if (since > durationFromSeconds(seconds)) return samples;
    const MotionState state = body.at(toSeconds(since));
    const double along = state.velocity_W.dot(state.T_WB.q * Eigen::Vector3d::UnitX());
    const double noise = dice.normal() * (errors.noise ? errors.sigma : 0.0);
    samples.push_back({0, i, epoch + since, errors.scale * along + noise, errors.sigma});
  }
}

}  // namespace perdure::sim
