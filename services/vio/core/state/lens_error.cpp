#include "services/vio/core/state/lens_error.h"

#include <cmath>

namespace perdure::vio {
namespace {

/// Returns the derivative of the distorted normalised point by k1 and k2.
Eigen::Matrix2d byRadialTerms(const CameraCalibration& camera, const Eigen::Vector2d& n) {
  const double r2 = n.squaredNorm();
  Eigen::Matrix2d J;
  if (camera.distortion == DistortionModel::kEquidistant) {
    const double r = std::sqrt(r2), t = std::atan(r), t2 = t * t;
    const Eigen::Vector2d direction = r > 1e-9 ? Eigen::Vector2d(n / r) : Eigen::Vector2d::Zero();
    J << t * t2 * direction, t * t2 * t2 * direction;
    return J;
  }
  double below = 1.0;
  if (camera.distortion == DistortionModel::kRational) {
    const auto& k = camera.distortion_coefficients;
    below += r2 * (k[5] + r2 * (k[6] + r2 * k[7]));
  }
  J << r2 / below * n, r2 * r2 / below * n;
  return J;
}

}  // namespace

Eigen::Matrix<double, 2, kLensSize> pixelByLens(const CameraModel& camera,
                                                const Eigen::Vector2d& normalised) {
  const Eigen::Vector2d centre(camera.cx(), camera.cy());
  Eigen::Matrix<double, 2, kLensSize> J;
  J.col(0) = camera.distort(normalised) - centre;
  J.middleCols<2>(1).setIdentity();
  J.rightCols<2>() = Eigen::Vector2d(camera.fx(), camera.fy()).asDiagonal() *
                     byRadialTerms(camera.calibration(), normalised);
  return J;
}

CameraModel withLens(const CameraModel& camera, const LensError& error) {
  CameraCalibration c = camera.calibration();
  c.fx *= std::exp(error[0]);
  c.fy *= std::exp(error[0]);
  c.cx += error[1];
  c.cy += error[2];
  if (c.distortion == DistortionModel::kNone) {
    c.distortion = DistortionModel::kRadialTangential;
    c.distortion_coefficients.assign(4, 0.0);
  }
  c.distortion_coefficients[0] += error[3];
  c.distortion_coefficients[1] += error[4];
  return CameraModel(c);
}

}  // namespace perdure::vio
