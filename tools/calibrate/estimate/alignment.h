// First guesses of what ties a camera to an IMU, in closed form: rotation and time offset from the
// rates at which both turn, gravity from the mean of the turned forces.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/math/rigid_transform.h"
#include "common/types/sensors.h"

namespace perdure::calibrate {

/// The camera at one time of its own clock.
struct CameraPose {
  double time_s = 0.0;
  RigidTransform T_TC;
};
struct ImuReading {
  double time_s = 0.0;
  Eigen::Vector3d gyro, accel;
};

struct Alignment {
  Eigen::Quaterniond q_BC = Eigen::Quaterniond::Identity();
  double time_offset_s = 0.0;  ///< t_imu = t_image + time_offset_s
  Eigen::Vector3d gyro_bias = Eigen::Vector3d::Zero();
  double rms = 0.0;                                      ///< rad/s, of what is left
  Eigen::Vector3d rate_rms_B = Eigen::Vector3d::Zero();  ///< how much the body turned, rad/s
  Eigen::Vector3d spread = Eigen::Vector3d::Zero();      ///< singular values, largest first
};

/// Poses and readings by time. Fails with calibrate_no_rotation (the mend: how to turn) or
/// calibrate_time_offset (no offset within ±`widest_s` fits).
Result<Alignment> alignRates(const std::vector<CameraPose>& poses,
                             const std::vector<ImuReading>& readings, double widest_s);

/// Whether each pose turned against most of its neighbours in time as the gyroscope did: a board
/// that was found upside down, or a view that has two explanations, did not.
std::vector<bool> agreeing(const std::vector<CameraPose>& poses,
                           const std::vector<ImuReading>& readings, const Alignment& alignment);

}  // namespace perdure::calibrate
