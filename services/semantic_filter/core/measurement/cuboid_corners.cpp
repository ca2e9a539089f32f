#include "services/semantic_filter/core/measurement/cuboid_corners.h"

#include "common/math/simd.h"
#include "common/math/so3.h"

namespace perdure::semantic_filter {

namespace {

/// Vectors in C: from the camera to the middle of a cuboid, and from there along half of each axis.
struct Frame {
  Eigen::Vector3d centre, along, across, up;
  double heading;
};

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

/// Computes the pixels of the corners for a camera without distortion, and the box around them.
PERDURE_ALSO_AVX2 void projectPoints(const CameraModel& camera, const PerCorner& x,
                                     const PerCorner& y, const PerCorner& z, int corners, double* u,
                                     double* v, Range<2>& box) {
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

/// Adds the points at which the near plane cuts the edges of the cuboid at corner i.
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

}  // namespace

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

Eigen::Vector2d pixelOf(const CameraModel& camera, const Eigen::Vector3d& p_C) {
  if (const auto pixel = camera.project(p_C)) return *pixel;
  const Eigen::Vector2d direction = p_C.head<2>() / p_C.z();
  return {camera.cx() + camera.fx() * direction.x() * 4.0,
          camera.cy() + camera.fy() * direction.y() * 4.0};
}

void projectCorners(const Corners& corners, const CameraModel& camera, ImagePoints& points) {
  const int n = corners.shape->corners();
  if (corners.all_before && camera.calibration().distortion == DistortionModel::kNone) {
    Range<2> box;
    projectPoints(camera, corners.x, corners.y, corners.z, n, points.u.data(), points.v.data(),
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

void setSide(ProjectedBox& box, int side, const SidePoint& point, const Projector& from,
             const Corners& corners) {
  const Eigen::RowVector3d by_W = point.by_C * from.R_CW;
  const Eigen::RowVector3d by_O = by_W * corners.R_WO;
  box.exact[side] = true;
  box.H.row(side).head<3>() = by_W;
  // A positive yaw turns x towards y.
  box.H(side, kYaw) = by_O.y() * point.local.x() - by_O.x() * point.local.y();
  box.H.row(side).segment<3>(kSize) = by_O.cwiseProduct(point.local.transpose());
  const Eigen::Vector3d p_B = from.R_BC * point.p_C + from.camera->T_BC().p;
  const Eigen::Vector3d by_B = from.R_BC * point.by_C.transpose();
  box.H_pose.row(side).head<3>() = by_B.cross(p_B).transpose();
  box.H_pose.row(side).tail<3>() = -by_W;
}

void setSide(ProjectedBox& box, int side, int corner, const Projector& from,
             const Corners& corners) {
  SidePoint point;
  if (corner != kCut) point = {corners.p_C(corner), corners.local(corner), {}};
  if (corner == kCut || !coordinateByPoint(*from.camera, point.p_C, side % 2, point.by_C)) {
    box.exact[side] = false;
    box.H.row(side).setZero();
    box.H_pose.row(side).setZero();
    return;
  }
  setSide(box, side, point, from, corners);
}

}  // namespace perdure::semantic_filter
