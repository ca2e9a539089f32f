#include "tools/simulate/render/lens.h"

#include <cmath>

namespace perdure::tools {
namespace {

/// The largest normalised radius that the distortion model can project, at most 20.
double maxRadiusOf(const CameraModel& model) {
  double low = 0.0, high = 20.0;
  if (model.project({high, 0.0, 1.0})) return high;
  for (int i = 0; i < 50; ++i) {
    const double middle = 0.5 * (low + high);
    (model.project({middle, 0.0, 1.0}) ? low : high) = middle;
  }
  return low;
}

}  // namespace

Lens::Lens(const CameraCalibration& calibration)
    : model_(calibration),
      width_(static_cast<int>(calibration.width)),
      height_(static_cast<int>(calibration.height)),
      pixel_angle_(static_cast<float>(1.0 / std::sqrt(calibration.fx * calibration.fy))),
      max_radius_(maxRadiusOf(model_)) {
  rays_.reserve(static_cast<std::size_t>((width_ + 1) * (height_ + 1)));
  for (int row = 0; row <= height_; ++row) {
    for (int column = 0; column <= width_; ++column) {
      const auto n = model_.unproject({column, row});
      const bool valid = n && n->norm() <= max_radius_;
      Eigen::Vector3f ray = Eigen::Vector3f::Zero();
      if (valid) ray = Eigen::Vector3d(n->x(), n->y(), 1.0).normalized().cast<float>();
      rays_.push_back(ray);
    }
  }
}

Eigen::Vector3f Lens::direction(int column, int row, float dx, float dy) const {
  const Eigen::Vector3f& centre = direction(column, row);
  const Eigen::Vector3f &right = direction(column + 1, row), &below = direction(column, row + 1);
  if (right.z() <= 0.0F || below.z() <= 0.0F) return centre;
  return (centre + dx * (right - centre) + dy * (below - centre)).normalized();
}

Eigen::Vector2d Lens::projectBeyond(const Eigen::Vector3d& point_C) const {
  const Eigen::Vector2d n = point_C.head<2>() / point_C.z();
  const double radius = n.norm();
  if (radius < max_radius_) return model_.distort(n);
  const Eigen::Vector2d edge = n * (max_radius_ / radius);
  const Eigen::Vector2d outward =
      (n - edge).cwiseProduct(Eigen::Vector2d(model_.fx(), model_.fy()));
  return model_.distort(edge) + outward;
}

}  // namespace perdure::tools
