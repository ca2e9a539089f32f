// Where a filter begins. At rest: gravity from the mean force, gyro bias from the mean rate. With
// a speed sensor: at once, in motion. With images alone: motion_initialiser.h.
#pragma once

#include <optional>
#include <vector>

#include "common/base/result.h"
#include "services/vio/core/estimator.h"
#include "services/vio/core/propagation/imu_buffer.h"
#include "services/vio/core/state/options.h"

namespace perdure::vio {

struct TimedSpeed {
  TimePoint time;
  double speed = 0.0, sigma = 0.1;
};

/// A start at rest at `now` from the samples of the window before it. Yaw 0, position 0.
/// Fails with "start_window_short", "start_force_not_gravity" or "start_turning".
Result<Start> startAtRest(const ImuBuffer& imu, TimePoint now, const Options& options);

/// A start at `now` with the speed there (body x); `speeds` around it give the acceleration.
/// Fails with "start_window_short" or "start_force_not_gravity".
Result<Start> startWithSpeed(const ImuBuffer& imu, TimePoint now, const SpeedReading& speed,
                             const std::vector<TimedSpeed>& speeds, const Options& options);

/// The attitude with yaw 0 in which `up_B` (not zero) points along z of W.
Eigen::Quaterniond levelAttitude(const Eigen::Vector3d& up_B);

/// Covariance of a start: tilt, yaw and position known as a gauge, the others given.
Eigen::Matrix<double, 15, 15> startCovariance(const Nav& nav, double tilt, double gyro_bias,
                                              double accel_bias, const Eigen::Vector3d& velocity_B);

}  // namespace perdure::vio
