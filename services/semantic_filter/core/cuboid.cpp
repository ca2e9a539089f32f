#include "services/semantic_filter/core/cuboid.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "common/math/so3.h"

namespace perdure::semantic_filter {
namespace {

constexpr double kNear = 0.2;  // metres

using PerCorner = Shape::PerCorner;

/// The corners of a shape before the camera.
struct Corners {
  Eigen::Matrix3d R_WO;
  Eigen::Vector3d half;  ///< of length, width, height
  const Shape* shape = nullptr;
  double facing = 0.0;
  PerCorner x, y, z;       ///< in C
  bool all_before = true;  ///< the near plane

  /// From the centre, along the cuboid's axes.
  Eigen::Vector3d local(int i) const { return half.cwiseProduct(shape->corner(i, facing)); }
  Eigen::Vector3d p_C(int i) const { return {x[i], y[i], z[i]}; }
};

constexpr int kCut = -1;

/// Pixels of corners, and of cuts by the near plane.
struct ImagePoints {
  using Coordinates = Eigen::Array<double, Eigen::Dynamic, 1, 0, kMostOutline, 1>;
  Coordinates u, v;
  std::array<int, kMostOutline> corner;  ///< or kCut

  Eigen::Vector4d sides() const { return {u.minCoeff(), v.minCoeff(), u.maxCoeff(), v.maxCoeff()}; }
  /// The corner whose u or v is this; a number that is none has no corner.
  int at(const Coordinates& values, double value) const {
    const auto i = std::find(values.begin(), values.end(), value) - values.begin();
    return i < values.size() ? corner[static_cast<std::size_t>(i)] : kCut;
  }
  void add(const Eigen::Vector2d& pixel, int of) {
    corner[static_cast<std::size_t>(u.size())] = of;
    u.conservativeResize(u.size() + 1);
    v.conservativeResize(v.size() + 1);
    u[u.size() - 1] = pixel.x();
    v[v.size() - 1] = pixel.y();
  }
};

/// Nothing where all of it lies behind the near plane. What reaches it is the cuboid, whose edges
/// are cut there.
std::optional<Corners> cornersBeforeCamera(const State& x, const Projector& from,
                                           const Shape& shape, double facing) {
  const Eigen::Vector3d centre_C = from.R_CW * (x.head<3>() - from.T_WC.p);
  const Eigen::Vector3d half = 0.5 * x.segment<3>(kSize).array().exp();
  const double reach = half.norm();
  if (centre_C.z() + reach < kNear) return std::nullopt;
  std::optional<Corners> result(std::in_place);
  Corners& c = *result;
  c.half = half;
  c.shape = centre_C.z() - reach < kNear ? &cuboidShape() : &shape;
  c.facing = facing;
  c.R_WO = from.R_WL * rotationAboutZ(x[kYaw]);
  const Eigen::Matrix3d R_CO = from.R_CW * c.R_WO;
  const Eigen::Vector3d along = half.x() * R_CO.col(0), across = half.y() * R_CO.col(1),
                        up = half.z() * R_CO.col(2);
  const Shape& s = *c.shape;
  const PerCorner forward = s.along + facing * s.forward;
  const auto coordinate = [&](int i) {
    return ((centre_C[i] + along[i] * forward) + across[i] * s.across) + up[i] * s.up;
  };
  c.x = coordinate(0);
  c.y = coordinate(1);
  c.z = coordinate(2);
  c.all_before = c.z.minCoeff() >= kNear;
  if (c.z.maxCoeff() < kNear) return std::nullopt;
  return result;
}

/// Pixel of a point in front; far outside the image where the distortion is not defined.
Eigen::Vector2d pixelOf(const CameraModel& camera, const Eigen::Vector3d& p_C) {
  if (const auto pixel = camera.project(p_C)) return *pixel;
  const Eigen::Vector2d direction = p_C.head<2>() / p_C.z();
  return {camera.cx() + camera.fx() * direction.x() * 4.0,
          camera.cy() + camera.fy() * direction.y() * 4.0};
}

/// Of the cuboid's edges.
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

ImagePoints imagePoints(const Corners& corners, const CameraModel& camera) {
  ImagePoints points;
  const int n = corners.shape->corners();
  if (corners.all_before && camera.calibration().distortion == DistortionModel::kNone) {
    const PerCorner inverse_depth = 1.0 / corners.z;
    points.u = camera.fx() * (corners.x * inverse_depth) + camera.cx();
    points.v = camera.fy() * (corners.y * inverse_depth) + camera.cy();
    std::iota(points.corner.begin(), points.corner.begin() + n, 0);
    return points;
  }
  for (int i = 0; i < n; ++i) {
    const Eigen::Vector3d a = corners.p_C(i);
    if (a.z() >= kNear) points.add(pixelOf(camera, a), i);
    if (!corners.all_before) addCuts(points, i, corners, camera);
  }
  return points;
}

/// Derivatives of a side, which is the image of a corner.
void setSide(ProjectedBox& box, int side, int corner, const Projector& from,
             const Corners& corners) {
  Eigen::Matrix<double, 2, 3> J_point;
  const Eigen::Vector3d p_C = corner == kCut ? Eigen::Vector3d::Zero() : corners.p_C(corner);
  if (corner == kCut || !from.camera->project(p_C, &J_point)) {
    box.exact[side] = false;
    return;
  }
  const Eigen::Vector3d local = corners.local(corner);
  const Eigen::RowVector3d by_C = J_point.row(side % 2);
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

Projector::Projector(const View& view)
    : camera(view.camera),
      T_WC(view.T_WC()),
      R_CW(T_WC.q.conjugate().toRotationMatrix()),
      R_BC(view.camera->T_BC().R()),
      R_WL(levelling(view.up_W).conjugate().toRotationMatrix()) {}

Eigen::Matrix3d uprightRotation(double yaw, const Eigen::Vector3d& up_W) {
  return levelling(up_W).conjugate().toRotationMatrix() * rotationAboutZ(yaw);
}

std::optional<ProjectedBox> projectCuboid(const State& x, const Projector& from, const Shape& shape,
                                          double facing) {
  std::optional<ProjectedBox> result;
  const auto corners = cornersBeforeCamera(x, from, shape, facing);
  if (!corners) return result;
  ProjectedBox& box = result.emplace();
  const ImagePoints points = imagePoints(*corners, *from.camera);
  box.sides = points.sides();
  for (int side = 0; side < 4; ++side) {
    setSide(box, side, points.at(side % 2 == 0 ? points.u : points.v, box.sides[side]), from,
            *corners);
  }
  return result;
}

std::optional<ProjectedOutline> projectOutline(const State& x, const Projector& from,
                                               const Shape& shape) {
  std::optional<ProjectedOutline> result;
  const auto corners = cornersBeforeCamera(x, from, shape, 0.0);
  if (!corners) return result;
  ProjectedOutline& outline = result.emplace();
  const ImagePoints points = imagePoints(*corners, *from.camera);
  outline.sides = points.sides();
  outline.points.resize(static_cast<std::size_t>(points.u.size()));
  for (int i = 0; i < points.u.size(); ++i) {
    outline.points[static_cast<std::size_t>(i)] = {points.u[i], points.v[i]};
  }
  return result;
}

std::optional<ProjectedBox> projectObserved(const State& x, const Projector& from,
                                            const BoxStyle& style, double facing) {
  auto box = projectCuboid(x, from, style.shape, facing);
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
