#include "services/semantic_filter/core/measurement/cuboid_projection.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "common/math/simd.h"
#include "common/math/so3.h"

namespace perdure::semantic_filter {

namespace {

constexpr double kNear = 0.2;  // metres

/// One number for each corner.
using PerCorner = std::array<double, Shape::kMostCorners>;

/// In C: from the camera to the middle of a cuboid, and from there along half of each axis.
struct Frame {
  Eigen::Vector3d centre, along, across, up;
  double heading;
};

/// Range of N coordinates.
template <int N>
struct Range {
  std::array<double, N> least, most;
};

/// Computes the corners of a shape in C, and the range of their depths.
PERDURE_ALSO_AVX2 void placeCorners(const Frame& frame, const Shape& shape, PerCorner& x,
                                    PerCorner& y, PerCorner& z, Range<1>& depths) {
  simd::Four least, most;
  double* const to[3] = {x.data(), y.data(), z.data()};
  for (int i = 0; i < shape.corners(); i += 4) {
    const simd::Four forward =
        simd::four(shape.along.data() + i) + frame.heading * simd::four(shape.forward.data() + i);
    const simd::Four across = simd::four(shape.across.data() + i);
    const simd::Four up = simd::four(shape.up.data() + i);
    for (int axis = 0; axis < 3; ++axis) {
      simd::four(to[axis] + i) =
          ((frame.centre[axis] + frame.along[axis] * forward) + frame.across[axis] * across) +
          frame.up[axis] * up;
    }
    const simd::Four depth = simd::four(z.data() + i);
    if (i == 0) least = most = depth;
    simd::keepLeast(least, depth);
    simd::keepMost(most, depth);
  }
  depths = {{simd::leastOf(least)}, {simd::mostOf(most)}};
}

/// Computes their pixels for a camera without distortion, and the box around them.
PERDURE_ALSO_AVX2 void projectCorners(const CameraModel& camera, const PerCorner& x,
                                      const PerCorner& y, const PerCorner& z, int corners,
                                      double* u, double* v, Range<2>& box) {
  simd::Four least[2], most[2];
  const double focal[2] = {camera.fx(), camera.fy()}, middle[2] = {camera.cx(), camera.cy()};
  const double* const from[2] = {x.data(), y.data()};
  double* const to[2] = {u, v};
  for (int i = 0; i < corners; i += 4) {
    const simd::Four inverse_depth = 1.0 / simd::four(z.data() + i);
    for (int axis = 0; axis < 2; ++axis) {
      const simd::Four pixels =
          focal[axis] * (simd::four(from[axis] + i) * inverse_depth) + middle[axis];
      simd::four(to[axis] + i) = pixels;
      if (i == 0) least[axis] = most[axis] = pixels;
      simd::keepLeast(least[axis], pixels);
      simd::keepMost(most[axis], pixels);
    }
  }
  for (int axis = 0; axis < 2; ++axis) {
    box.least[axis] = simd::leastOf(least[axis]);
    box.most[axis] = simd::mostOf(most[axis]);
  }
}

/// The corners of a shape, relative to the camera.
struct Corners {
  Eigen::Matrix3d R_WO;
  Eigen::Vector3d half;  ///< of length, width, height
  const Shape* shape = nullptr;
  double heading = 0.0;
  PerCorner x, y, z;       ///< in C
  bool all_before = true;  ///< all corners are before the near plane

  /// Returns corner i from the centre, along the axes of the cuboid.
  Eigen::Vector3d local(int i) const { return half.cwiseProduct(shape->corner(i, heading)); }
  Eigen::Vector3d p_C(int i) const {
    const auto k = static_cast<std::size_t>(i);
    return {x[k], y[k], z[k]};
  }
};

constexpr int kCut = -1;

/// Pixels of corners, and of cuts of edges by the near plane.
struct ImagePoints {
  using Coordinates = std::array<double, kMostOutline>;
  Coordinates u, v;
  /// corner index or kCut; not set if all points are corners in order
  std::array<int, kMostOutline> corner;
  bool in_order = false;
  std::size_t size = 0;
  Eigen::Vector4d sides;

  /// Returns the corner whose u or v has this value, or kCut.
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

/// Returns false if the whole object is behind the near plane. An object that reaches the near
/// plane is treated as its cuboid, whose edges are cut there.
bool cornersBeforeCamera(const State& x, const Projector& from, const Shape& shape, double heading,
                         Corners& c) {
  Frame frame;
  frame.centre = from.R_CW * (x.head<3>() - from.T_WC.p);
  c.half = 0.5 * x.segment<3>(kSize).array().exp();
  const double reach = c.half.norm();
  if (frame.centre.z() + reach < kNear) return false;
  c.shape = frame.centre.z() - reach < kNear ? &cuboidShape() : &shape;
  c.heading = frame.heading = heading;
  c.R_WO = from.R_WL * rotationAboutZ(x[kYaw]);
  const Eigen::Matrix3d R_CO = from.R_CW * c.R_WO;
  frame.along = c.half.x() * R_CO.col(0);
  frame.across = c.half.y() * R_CO.col(1);
  frame.up = c.half.z() * R_CO.col(2);
  Range<1> depths;
  placeCorners(frame, *c.shape, c.x, c.y, c.z, depths);
  c.all_before = depths.least[0] >= kNear;
  return depths.most[0] >= kNear;
}

/// Pixel of a point in front of the camera. Where the distortion is not defined, it lies far
/// outside the image.
Eigen::Vector2d pixelOf(const CameraModel& camera, const Eigen::Vector3d& p_C) {
  if (const auto pixel = camera.project(p_C)) return *pixel;
  const Eigen::Vector2d direction = p_C.head<2>() / p_C.z();
  return {camera.cx() + camera.fx() * direction.x() * 4.0,
          camera.cy() + camera.fy() * direction.y() * 4.0};
}

/// Adds the cuts of the cuboid's edges at corner i by the near plane.
void addCuts(ImagePoints& points, int i, const Corners& corners, const CameraModel& camera) {
  const Eigen::Vector3d a = corners.p_C(i);
  for (int axis = 1; axis < 8; axis <<= 1) {
    const int j = i | axis;
    if (j == i) continue;
    const Eigen::Vector3d b = corners.p_C(j);
    if ((a.z() >= kNear) == (b.z() >= kNear)) continue;
    const double s = (kNear - a.z()) / (b.z() - a.z());
    points.add(pixelOf(camera, a + s * (b - a)), kCut);
  }
}

void project(const Corners& corners, const CameraModel& camera, ImagePoints& points) {
  const int n = corners.shape->corners();
  if (corners.all_before && camera.calibration().distortion == DistortionModel::kNone) {
    Range<2> box;
    projectCorners(camera, corners.x, corners.y, corners.z, n, points.u.data(), points.v.data(),
                   box);
    points.in_order = true;
    points.size = static_cast<std::size_t>(n);
    points.sides = {box.least[0], box.least[1], box.most[0], box.most[1]};
    return;
  }
  for (int i = 0; i < n; ++i) {
    const Eigen::Vector3d a = corners.p_C(i);
    if (a.z() >= kNear) points.add(pixelOf(camera, a), i);
    if (!corners.all_before) addCuts(points, i, corners, camera);
  }
  points.bound();
}

/// Derivative of one image coordinate of a point in front of the camera. Returns false where there
/// is none.
bool coordinateByPoint(const CameraModel& camera, const Eigen::Vector3d& p_C, int axis,
                       Eigen::RowVector3d& by_C) {
  if (camera.calibration().distortion == DistortionModel::kNone) {
    const double focal = axis == 0 ? camera.fx() : camera.fy(), inverse_depth = 1.0 / p_C.z();
    by_C.setZero();
    by_C[axis] = focal * inverse_depth;
    by_C[2] = focal * (-(p_C[axis] * inverse_depth) * inverse_depth);
    return true;
  }
  Eigen::Matrix<double, 2, 3> J_point;
  if (!camera.project(p_C, &J_point)) return false;
  by_C = J_point.row(axis);
  return true;
}

/// Sets the derivatives of a side, which is the image of a corner.
void setSide(ProjectedBox& box, int side, int corner, const Projector& from,
             const Corners& corners) {
  const Eigen::Vector3d p_C = corner == kCut ? Eigen::Vector3d::Zero() : corners.p_C(corner);
  Eigen::RowVector3d by_C;
  if (corner == kCut || !coordinateByPoint(*from.camera, p_C, side % 2, by_C)) {
    box.exact[side] = false;
    return;
  }
  const Eigen::Vector3d local = corners.local(corner);
  const Eigen::RowVector3d by_W = by_C * from.R_CW;
  const Eigen::RowVector3d by_O = by_W * corners.R_WO;
  box.H.row(side).head<3>() = by_W;
  box.H(side, kYaw) = by_O.y() * local.x() - by_O.x() * local.y();  // turns x towards y
  box.H.row(side).segment<3>(kSize) = by_O.cwiseProduct(local.transpose());
  const Eigen::Vector3d p_B = from.R_BC * p_C + from.camera->T_BC().p;
  const Eigen::Vector3d by_B = from.R_BC * by_C.transpose();
  box.H_pose.row(side).head<3>() = by_B.cross(p_B).transpose();
  box.H_pose.row(side).tail<3>() = -by_W;
}

}  // namespace

std::optional<ProjectedBox> projectCuboid(const State& x, const Projector& from, const Shape& shape,
                                          double heading) {
  std::optional<ProjectedBox> result;
  Corners corners;
  if (!cornersBeforeCamera(x, from, shape, heading, corners)) return result;
  ProjectedBox& box = result.emplace();
  ImagePoints points;
  project(corners, *from.camera, points);
  box.sides = points.sides;
  for (int side = 0; side < 4; ++side) {
    setSide(box, side, points.at(side % 2 == 0 ? points.u : points.v, box.sides[side]), from,
            corners);
  }
  return result;
}

std::optional<ProjectedOutline> projectOutline(const State& x, const Projector& from,
                                               const Shape& shape) {
  std::optional<ProjectedOutline> result;
  Corners corners;
  if (!cornersBeforeCamera(x, from, shape, 0.0, corners)) return result;
  ProjectedOutline& outline = result.emplace();
  ImagePoints points;
  project(corners, *from.camera, points);
  outline.sides = points.sides;
  outline.points.resize(points.size);
  for (std::size_t i = 0; i < points.size; ++i) {
    outline.points[i] = {points.u[i], points.v[i]};
  }
  return result;
}

std::optional<ProjectedBox> projectObserved(const State& x, const Projector& from,
                                            const BoxStyle& style, double heading) {
  auto box = projectCuboid(x, from, style.shape, heading);
  if (!box) return box;
  const double limit[2] = {2.0 * from.camera->width(), 2.0 * from.camera->height()};
  for (int low = 0; low < 2; ++low) {
    const int high = low + 2;
    const double extent = box->sides[high] - box->sides[low];
    const Eigen::Matrix<double, 1, kGeometry> by_state =
        (box->H.row(high) - box->H.row(low)).head<kGeometry>();
    const Eigen::Matrix<double, 1, 6> by_pose = box->H_pose.row(high) - box->H_pose.row(low);
    for (const int i : {low, high}) {
      const double b = x[kBias + i] + style.offset[i];
      box->sides[i] += b * std::min(extent, limit[low]);
      box->H(i, kBias + i) = std::min(extent, limit[low]);
      if (extent >= limit[low]) continue;
      box->H.row(i).head<kGeometry>() += b * by_state;
      box->H_pose.row(i) += b * by_pose;
    }
  }
  return box;
}

double yawFromAzimuth(double azimuth, const Eigen::Vector3d& centre_W, const View& view) {
  const RigidTransform T_WC = view.T_WC();
  const Eigen::Vector3d down = -view.up_W;
  const Eigen::Vector3d optical = T_WC.R().col(2);
  const Eigen::Vector3d forward = (optical - optical.dot(down) * down).normalized();
  const Eigen::Vector3d right = down.cross(forward);
  const Eigen::Vector3d ray = centre_W - T_WC.p;
  const double rotation_y = azimuth + std::atan2(ray.dot(right), ray.dot(forward));
  const Eigen::Vector3d length_axis = std::cos(rotation_y) * right - std::sin(rotation_y) * forward;
  const Eigen::Vector3d level = levelling(view.up_W) * length_axis;
  return std::atan2(level.y(), level.x());
}

}  // namespace perdure::semantic_filter
