// A folder in EuRoC's layout. Its camera rotates on the spot before a textured sphere. Images,
// gyroscope and gravity agree exactly, until a test changes one of them.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <functional>
#include <string>

#include "common/types/sensors.h"

namespace perdure::tests {

struct TurningDrive {
  double seconds = 2.0, images_hz = 20.0, imu_hz = 200.0;
  double turning = 0.6;  ///< rad/s, amplitude about each axis
  std::int64_t first_ns = 1'000'000'000'000'000'000;
  Duration images_late{0};  ///< excess of the images' stamps
  Eigen::Vector3d gyro_bias{0.01, -0.02, 0.015};
  /// Applied to each IMU sample before it is written.
  std::function<void(ImuSample&)> change = [](ImuSample&) {};
  RigidTransform written_T_BC;  ///< camera pose in sensor.yaml; the true pose by default
  TurningDrive();
};

/// True pose of the camera, which looks along the body's x.
RigidTransform trueCameraPlace();
/// Writes a new folder.
std::filesystem::path makeTurningDrive(const std::string& name, const TurningDrive& drive = {});

}  // namespace perdure::tests
