// Error of a camera's lens, relative to its calibration, and its effect on pixels.
#pragma once

#include <Eigen/Core>

#include "common/camera/camera_model.h"

namespace perdure::vio {

/// [logarithm of both focal lengths, c_x and c_y in px, k1, k2]: true minus calibrated.
inline constexpr int kLensSize = 5;
using LensError = Eigen::Matrix<double, kLensSize, 1>;

/// Returns the derivative of a point's pixel by the lens error of `camera`. `normalised` is the
/// undistorted point, x/z and y/z.
Eigen::Matrix<double, 2, kLensSize> pixelByLens(const CameraModel& camera,
                                                const Eigen::Vector2d& normalised);

/// Returns the camera whose lens differs from that of `camera` by `error`. A lens without
/// distortion becomes radial-tangential.
CameraModel withLens(const CameraModel& camera, const LensError& error);

}  // namespace perdure::vio
