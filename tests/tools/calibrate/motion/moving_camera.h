// A camera and an IMU that turn and walk among points, as tracked corners with exact truth.
#pragma once

#include <cstdint>

#include "tools/calibrate/motion/joint.h"

namespace perdure::tests {

struct MovingCamera {
  calibrate::JointState truth;
  std::vector<ImuSample> samples;
  std::vector<calibrate::TrackWindow> windows;
};

struct MovingCameraOptions {
  calibrate::JointState truth;
  std::uint32_t seed = 1;
  std::size_t windows = 20, points = 20;
  double sigma_px = 0.2;
  double way_m = 0.15;               ///< amplitude of the translation
  Eigen::Vector3d turning{1, 1, 1};  ///< amplitudes about the body's axes, rad/s
};

/// 640 by 480 pixels, 20 Hz, IMU 200 Hz.
MovingCamera moveCamera(const MovingCameraOptions& options);
/// A lens of that size with a usual mounting: offset and readout in s.
calibrate::JointState phoneWith(double focal, double offset_s, double readout_s);

}  // namespace perdure::tests
