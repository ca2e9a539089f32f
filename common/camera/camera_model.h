// Projection of points of the camera frame (z forward, x right, y down) into pixels, with
// Jacobians. Models: pinhole with no, radial-tangential (Brown), rational or equidistant
// (Kannala-Brandt) distortion, as OpenCV and EuRoC define them.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>

#include "common/types/sensors.h"

namespace perdure {

using LensCoefficients = std::array<double, 8>;  ///< k1 k2 p1 p2 k3 k4 k5 k6; those absent are 0

/// Radial-tangential or rational distortion of a normalised point; J = d distorted / d normalised.
Eigen::Vector2d distortRadTan(DistortionModel model, const LensCoefficients& d,
                              const Eigen::Vector2d& normalised, Eigen::Matrix2d* J);

class CameraModel {
 public:
  /// Checks that the calibration is usable (focal lengths > 0, as many coefficients as the model
  /// has).
  explicit CameraModel(const CameraCalibration& calibration);

  /// Pixel of a point in C. Returns nothing if the point is not in front of the camera (z < 1e-3 m)
  /// or lies outside the range in which the distortion is invertible. J_point (2×3) = d pixel / d
  /// point, if given.
  std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& point_C,
                                         Eigen::Matrix<double, 2, 3>* J_point = nullptr) const;
  /// Normalised, undistorted image point (x/z, y/z) of a pixel, by Newton's iteration. Returns
  /// nothing if the iteration does not converge.
  std::optional<Eigen::Vector2d> unproject(const Eigen::Vector2d& pixel) const;
  /// Distorted pixel of a normalised point; J (2×2) = d pixel / d normalised.
  Eigen::Vector2d distort(const Eigen::Vector2d& normalised, Eigen::Matrix2d* J = nullptr) const;

  bool inImage(const Eigen::Vector2d& pixel, double margin_px = 0.0) const {
    return pixel.x() >= margin_px && pixel.y() >= margin_px && pixel.x() < width() - margin_px &&
           pixel.y() < height() - margin_px;
  }
  double width() const { return width_; }
  double height() const { return height_; }
  double fx() const { return fx_; }
  double fy() const { return fy_; }
  double cx() const { return cx_; }
  double cy() const { return cy_; }
  const RigidTransform& T_BC() const { return T_BC_; }
  const CameraCalibration& calibration() const { return calibration_; }

 private:
  CameraCalibration calibration_;
  double width_, height_, fx_, fy_, cx_, cy_;
  LensCoefficients d_{};
  double max_radius2_;  ///< squared normalised radius up to which the distortion is monotone
  RigidTransform T_BC_;
};

/// Returns true if name, size, lens, pose on the body and times are exactly equal. The nominal rate
/// may differ.
bool sameCamera(const CameraCalibration& a, const CameraCalibration& b);

}  // namespace perdure
