// Initial state at rest, or in motion with a speed sensor (images alone: motion_initialiser.h).
#pragma once

#include <vector>

#include "common/base/result.h"
#include "common/types/sensors.h"
#include "services/vio/core/estimator.h"
#include "services/vio/core/propagation/imu_buffer.h"
#include "services/vio/core/state/options.h"

namespace perdure::vio {

/// Start at rest at `now`, from the samples of the window before it, with yaw 0 and position 0.
/// Fails with "start_window_short", "start_force_not_gravity" or "start_turning".
Result<Start> startAtRest(const ImuBuffer& imu, TimePoint now, const Options& options);

/// Start at `now` with the speed along body x. `speeds` around `now` give the acceleration. Fails
/// with "start_window_short" or "start_force_not_gravity".
Result<Start> startWithSpeed(const ImuBuffer& imu, TimePoint now, const SpeedReading& speed,
                             const std::vector<SpeedSample>& speeds, const Options& options);

/// Attitude with yaw 0 that aligns `up_B` (not zero) with z of W.
Eigen::Quaterniond levelAttitude(const Eigen::Vector3d& up_B);

/// Covariance of a start. Yaw and position define W; the other deviations are arguments.
Eigen::Matrix<double, 15, 15> startCovariance(const Nav& nav, double tilt, double gyro_bias,
                                              double accel_bias, const Eigen::Vector3d& velocity_B);

}  // namespace perdure::vio
