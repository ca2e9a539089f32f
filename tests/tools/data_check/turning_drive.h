// A folder in EuRoC's layout whose camera turns on the spot before a textured sphere: images,
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
  Duration images_late{0};  ///< what their stamps are too large by
  Eigen::Vector3d gyro_bias{0.01, -0.02, 0.015};
  /// Of what is written for the IMU.
  std::function<void(ImuSample&)> change = [](ImuSample&) {};
  RigidTransform written_T_BC;  ///< in sensor.yaml; the true one by default
  TurningDrive();
};

/// The true place of the camera: it looks along the body's x.
RigidTransform trueCameraPlace();
/// Writes the folder, anew.
std::filesystem::path makeTurningDrive(const std::string& name, const TurningDrive& drive = {});

}  // namespace perdure::tests
