// Initial state at rest, or in motion with a speed sensor. Starts in motion without one:
// motion_initialiser.h.
#pragma once

#include <vector>

#include "common/base/result.h"
#include "common/types/sensors.h"
#include "services/vio/core/estimator.h"
#include "services/vio/core/propagation/imu_buffer.h"
#include "services/vio/core/state/options.h"

namespace perdure::vio {

/// Returns a start at rest at `now`, with yaw 0 and position 0, from the samples of the last
/// `start.rest_window_s`. Fails with "start_window_short", "start_force_not_gravity" or
/// "start_turning".
Result<Start> startAtRest(const ImuBuffer& imu, TimePoint now, const Options& options);

/// Returns a start at `now` with the speed along body x. The acceleration is computed from
/// `speeds`. Fails with "start_window_short" or "start_force_not_gravity".
Result<Start> startWithSpeed(const ImuBuffer& imu, TimePoint now, const SpeedReading& speed,
                             const std::vector<SpeedSample>& speeds, const Options& options);

/// Returns the attitude with yaw 0 that aligns `up_B` (not zero) with z of W.
Eigen::Quaterniond levelAttitude(const Eigen::Vector3d& up_B);

/// Returns the covariance of a start from standard deviations (rad, rad/s, m/s², m/s). Those of yaw
/// and position are nearly zero, because they define W.
Eigen::Matrix<double, 15, 15> startCovariance(const Nav& nav, double tilt, double gyro_bias,
                                              double accel_bias, const Eigen::Vector3d& velocity_B);

}  // namespace perdure::vio
