// Cameras of the filter, the error of a lens relative to its calibration, and its effect on pixels.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <memory>
#include <vector>

#include "common/camera/camera_model.h"

namespace perdure::vio {

inline constexpr std::size_t kMaxCameras = 2;

/// One or two cameras. The pointer keeps them as they were when an image's points were undistorted.
using SharedCameras = std::shared_ptr<const std::vector<CameraModel>>;

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
