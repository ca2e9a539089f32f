// Simulates an IMU in the body frame: point samples of the exact motion, with errors of the
// continuous-time model of Kalibr and EuRoC (densities of white noise and bias random walk). Also
// simulates the wheel speed of a vehicle.
#pragma once

#include <vector>

#include "common/sim/scene.h"
#include "common/sim/trajectory.h"
#include "common/types/sensors.h"

namespace perdure::sim {

inline constexpr double kGravity = 9.81;  ///< m/s²; W's z axis points against it

struct ImuRecord {
  ImuSample sample;
  /// The true biases at the time of the sample.
  Eigen::Vector3d gyro_bias = Eigen::Vector3d::Zero(), accel_bias = Eigen::Vector3d::Zero();
};

/// Returns samples from the scene's t = 0 until `seconds`, at calibration.rate_hz. `epoch` is the
/// sensor time of t = 0. A shorter record equals the start of a longer one.
std::vector<ImuRecord> simulateImu(const Trajectory& body, const ImuCalibration& calibration,
                                   const ImuErrors& errors, std::uint64_t seed, double seconds,
                                   TimePoint epoch);

/// Returns samples from the scene's t = 0 until `seconds`; `epoch` is the sensor time of t = 0.
std::vector<SpeedSample> simulateSpeed(const Trajectory& body, const SpeedErrors& errors,
                                       std::uint64_t seed, double seconds, TimePoint epoch);

}  // namespace perdure::sim
