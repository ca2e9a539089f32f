// The ray of each pixel of a distorted camera, and where points beyond its image would be drawn.
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
  /// Whether the distortion can be inverted there.
  bool sees(int column, int row) const { return rays_[indexOf(column, row)].z() > 0.0F; }
  /// Unit direction in C through a pixel's centre.
  const Eigen::Vector3f& direction(int column, int row) const {
    return rays_[indexOf(column, row)];
  }
  /// The same at an offset within the pixel.
  Eigen::Vector3f direction(int column, int row, float dx, float dy) const;
  /// Angle between neighbouring pixels in the image's centre, radians.
  float pixelAngle() const { return pixel_angle_; }
  /// Pixel of any point with z > 0; beyond the distortion's range, the outermost valid pixel in
  /// that direction is carried on radially at the focal length.
  Eigen::Vector2d projectBeyond(const Eigen::Vector3d& point_C) const;

 private:
  std::size_t indexOf(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(width_ + 1) +
           static_cast<std::size_t>(column);
  }

  CameraModel model_;
  int width_, height_;
  float pixel_angle_;
  double max_radius_;  ///< of the normalised image, up to which project() answers
  std::vector<Eigen::Vector3f>
      rays_;  ///< (x, y, 1), or z = 0 where there is none; one more each way
};

}  // namespace perdure::tools
