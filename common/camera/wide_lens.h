// Lens models of wide-angle cameras as in Kalibr, and the equidistant lens that approximates them.
// Models: unified (Mei and Rives, ICRA 2007, eq. 1-4; Kalibr "omni"), extended unified (Khomutenko
// et al., RA-L 2016, eq. 9; "eucm"), double sphere (Usenko et al., 3DV 2018, eq. 40-45; "ds").
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>

#include "common/base/result.h"
#include "common/types/sensors.h"

namespace perdure {

struct WideLens {
  enum class Kind { kUnified, kExtendedUnified, kDoubleSphere };
  Kind kind = Kind::kUnified;
  double a = 0.0;                         ///< unified, double sphere: xi; extended unified: alpha
  double b = 0.0;                         ///< extended unified: beta; double sphere: alpha
  double fx = 0, fy = 0, cx = 0, cy = 0;  ///< pixels
  std::array<double, 4> distortion{};     ///< k1 k2 p1 p2 of the unified model (omni-radtan)
};

/// Pixel of a point in the camera's frame. Returns nothing if the point has no projection. J (2×3)
/// = d pixel / d point, if given.
std::optional<Eigen::Vector2d> project(const WideLens& lens, const Eigen::Vector3d& point,
                                       Eigen::Matrix<double, 2, 3>* J = nullptr);

struct EquidistantFit {
  double rms_px = 0, max_px = 0;  ///< errors over the image, up to `angle` from the axis
  double angle = 0;               ///< radians
};

/// Sets the equidistant lens in `camera` (whose size is set) that best approximates `lens` over its
/// image, up to 85° off the axis. Nothing in Perdure uses larger angles. Reason: "intrinsics", if
/// the lens does not project into its image, or if the best approximation errs by more than half a
/// pixel.
Result<EquidistantFit> fitEquidistant(const WideLens& lens, CameraCalibration& camera);

}  // namespace perdure
