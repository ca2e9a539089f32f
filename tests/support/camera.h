// The camera of most tests, which looks ahead from the body.
#pragma once

#include <cstdint>

#include "common/types/sensors.h"

namespace perdure::tests {

/// R_BC of a camera that looks along the body's x: z ahead, x to the right, y down.
inline Eigen::Matrix3d lookingAhead() {
  Eigen::Matrix3d R_BC;
  R_BC << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  return R_BC;
}

/// cam0 at `p_BC`: a pinhole camera without distortion, with the principal point at the image's
/// centre.
inline CameraCalibration cameraAhead(std::uint32_t width, std::uint32_t height, double focal,
                                     const Eigen::Vector3d& p_BC = Eigen::Vector3d::Zero()) {
  CameraCalibration camera;
  camera.name = "cam0";
  camera.width = width, camera.height = height;
  camera.fx = camera.fy = focal;
  camera.cx = 0.5 * width, camera.cy = 0.5 * height;
  camera.T_BC = RigidTransform(lookingAhead(), p_BC);
  return camera;
}

}  // namespace perdure::tests
