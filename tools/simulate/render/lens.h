// The ray of each pixel of a distorted camera, and a projection beyond the image border.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "common/camera/camera_model.h"

namespace perdure::tools {

class Lens {
 public:
  explicit Lens(const CameraCalibration& calibration);

  int width() const { return width_; }
  int height() const { return height_; }
  const CameraModel& model() const { return model_; }
  /// Whether the distortion can be inverted at the pixel.
  bool sees(int column, int row) const { return rays_[indexOf(column, row)].z() > 0.0F; }
  /// Unit direction in C through a pixel's centre.
  const Eigen::Vector3f& direction(int column, int row) const {
    return rays_[indexOf(column, row)];
  }
  /// Returns the direction at an offset within the pixel.
  Eigen::Vector3f direction(int column, int row, float dx, float dy) const;
  /// Angle between neighbouring pixels at the image centre, radians.
  float pixelAngle() const { return pixel_angle_; }
  /// Pixel of any point with z > 0. If the distortion is not valid for the point, the outermost
  /// valid pixel in its direction is extended radially by the focal length.
  Eigen::Vector2d projectBeyond(const Eigen::Vector3d& point_C) const;

 private:
  std::size_t indexOf(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(width_ + 1) +
           static_cast<std::size_t>(column);
  }

  CameraModel model_;
  int width_, height_;
  float pixel_angle_;
  double max_radius_;  ///< largest radius in the normalised image for project()
  std::vector<Eigen::Vector3f>
      rays_;  ///< (x, y, 1), or z = 0 if invalid; has a border of one pixel
};

}  // namespace perdure::tools
