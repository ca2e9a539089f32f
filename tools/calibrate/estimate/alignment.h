// Initial estimates, in closed form, of a camera's extrinsics on an IMU: rotation and time offset
// from the angular rates of both, and gravity from the mean of the rotated specific forces.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "common/base/result.h"
#include "common/math/rigid_transform.h"
#include "common/types/sensors.h"

namespace perdure::calibrate {

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
  double rms = 0.0;                                      ///< rad/s, RMS of the residuals
  Eigen::Vector3d rate_rms_B = Eigen::Vector3d::Zero();  ///< rad/s, RMS rotation about each axis
  Eigen::Vector3d spread = Eigen::Vector3d::Zero();      ///< singular values, largest first
};

/// Aligns poses and readings, both sorted by time. Fails with calibrate_no_rotation (the detail
/// states which motion is needed) or calibrate_time_offset (no offset within ±`widest_s` fits).
Result<Alignment> alignRates(const std::vector<CameraPose>& poses,
                             const std::vector<ImuReading>& readings, double widest_s);

/// For each pose, whether it rotated as the gyroscope did. A board detected upside down does not.
std::vector<bool> agreeing(const std::vector<CameraPose>& poses,
                           const std::vector<ImuReading>& readings, const Alignment& alignment);

}  // namespace perdure::calibrate
