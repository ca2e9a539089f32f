// What an IMU in the body reports: point samples of the exact motion, with the errors of the
// continuous-time model of Kalibr and EuRoC (white noise and a bias that walks, by densities).
#pragma once

#include <vector>

#include "common/sim/scene.h"
#include "common/sim/trajectory.h"
#include "common/types/sensors.h"

namespace perdure::sim {

inline constexpr double kGravity = 9.81;  ///< m/s²; W's z axis points against it

struct ImuRecord {
  ImuSample sample;
  /// What was in it, at its time.
  Eigen::Vector3d gyro_bias = Eigen::Vector3d::Zero(), accel_bias = Eigen::Vector3d::Zero();
};

/// From the scene's t = 0 until `seconds`, at calibration.rate_hz; `epoch` is the sensor time of
/// t = 0. A prefix of a longer record is the same record.
std::vector<ImuRecord> simulateImu(const Trajectory& body, const ImuCalibration& calibration,
                                   const ImuErrors& errors, std::uint64_t seed, double seconds,
                                   TimePoint epoch);

}  // namespace perdure::sim
