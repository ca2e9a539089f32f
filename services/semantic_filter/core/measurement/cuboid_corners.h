// The corners of a shape in front of the camera, and their images
// (tools/docs/maths/cuboid_projection.md).
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstddef>

#include "common/camera/camera_model.h"
#include "services/semantic_filter/core/belief/classes/shape.h"
#include "services/semantic_filter/core/measurement/cuboid_projection.h"

namespace perdure::semantic_filter {

inline constexpr double kNear = 0.2;  ///< depth of the near plane, m

using PerCorner = std::array<double, Shape::kMostCorners>;

struct Corners {
  Eigen::Matrix3d R_WO;
  Eigen::Vector3d half;  ///< of length, width and height, m
  const Shape* shape = nullptr;
  double heading = 0.0;
  PerCorner x, y, z;       ///< in C
  bool all_before = true;  ///< no corner is behind the near plane

  /// Returns corner i in O, m.
  Eigen::Vector3d local(int i) const { return half.cwiseProduct(shape->corner(i, heading)); }
  Eigen::Vector3d p_C(int i) const {
    const auto k = static_cast<std::size_t>(i);
    return {x[k], y[k], z[k]};
  }
};

inline constexpr int kCut = -1;

/// Pixels of corners, and of the points at which the near plane cuts edges.
struct ImagePoints {
  using Coordinates = std::array<double, kMostOutline>;
  Coordinates u, v;
  /// corner index or kCut; not set if all points are corners in order
  std::array<int, kMostOutline> corner;
  bool in_order = false;
  std::size_t size = 0;
  Eigen::Vector4d sides;

  /// Returns the corner with this value. `values`: u or v. Returns kCut if it is not a corner.
  int at(const Coordinates& values, double value) const {
    for (std::size_t i = 0; i < size; ++i) {
      if (values[i] == value) return in_order ? static_cast<int>(i) : corner[i];
    }
    return kCut;
  }
  void add(const Eigen::Vector2d& pixel, int of) {
    corner[size] = of;
    u[size] = pixel.x();
    v[size] = pixel.y();
    ++size;
  }
  void bound() {
    const auto [u_least, u_most] = std::minmax_element(u.begin(), u.begin() + size);
    const auto [v_least, v_most] = std::minmax_element(v.begin(), v.begin() + size);
    sides = {*u_least, *v_least, *u_most, *v_most};
  }
};

/// Computes the corners in C. Returns false if the whole object is behind the near plane. An object
/// that reaches the near plane is treated as its cuboid, whose edges are cut there.
bool cornersBeforeCamera(const State& x, const Projector& from, const Shape& shape, double heading,
                         Corners& corners);

/// Computes the pixels of all corners, and of the points at which the near plane cuts edges.
void projectCorners(const Corners& corners, const CameraModel& camera, ImagePoints& points);

/// Returns the pixel of a point in front of the camera. If its distortion is not defined, the pixel
/// is far outside the image.
Eigen::Vector2d pixelOf(const CameraModel& camera, const Eigen::Vector3d& p_C);

/// Computes the derivative of one image coordinate of a point in front of the camera by the point.
/// Returns false if it is not defined.
bool coordinateByPoint(const CameraModel& camera, const Eigen::Vector3d& p_C, int axis,
                       Eigen::RowVector3d& by_C);

/// A point of the object that determines a side of its box.
struct SidePoint {
  Eigen::Vector3d p_C;
  Eigen::Vector3d local;    ///< from the centre, along the axes of the cuboid
  Eigen::RowVector3d by_C;  ///< derivative of the side's coordinate by p_C
};

void setSide(ProjectedBox& box, int side, const SidePoint& point, const Projector& from,
             const Corners& corners);
/// Sets a side that is the image of a corner. With kCut the side is not exact.
void setSide(ProjectedBox& box, int side, int corner, const Projector& from,
             const Corners& corners);

}  // namespace perdure::semantic_filter
