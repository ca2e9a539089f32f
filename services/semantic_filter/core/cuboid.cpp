#include "services/semantic_filter/core/cuboid.h"

#include <cmath>

#include "common/math/so3.h"

namespace perdure::semantic_filter {
namespace {

constexpr double kNear = 0.2;  // metres

struct Corner {
  Eigen::Vector3d p_C;
  Eigen::Matrix<double, 3, kStateDim> J;  ///< d p_C / d x
  Eigen::Matrix<double, 3, 6> J_pose;
};

struct ImagePoint {
  Eigen::Vector2d pixel;
  int corner;  ///< -1: a cut by the near plane
};

Corner makeCorner(int i, const State& x, const View& view, const Eigen::Matrix3d& R_WO,
                  const Eigen::Matrix3d& R_CW) {
  const Eigen::Vector3d unit((i & 1) ? 0.5 : -0.5, (i & 2) ? 0.5 : -0.5, (i & 4) ? 0.5 : -0.5);
  const Eigen::Vector3d local = x.segment<3>(kSize).array().exp() * unit.array();
  const Eigen::Vector3d offset_W = R_WO * local;
  const Eigen::Vector3d p_B = view.T_WB.inverse() * Eigen::Vector3d(x.head<3>() + offset_W);
  const Eigen::Matrix3d R_CB = view.camera->T_BC().R().transpose();
  Corner c;
  c.p_C = R_CB * (p_B - view.camera->T_BC().p);
  c.J.setZero();
  c.J.leftCols<3>() = R_CW;
  c.J.col(kYaw) = R_CW * R_WO.col(2).cross(offset_W);
  for (int k = 0; k < 3; ++k) c.J.col(kSize + k) = R_CW * R_WO.col(k) * local[k];
  c.J_pose.leftCols<3>() = R_CB * skew(p_B);
  c.J_pose.rightCols<3>() = -R_CW;
  return c;
}

/// Pixel of a point in front; far outside the image where the distortion is not defined.
Eigen::Vector2d pixelOf(const CameraModel& camera, const Eigen::Vector3d& p_C) {
  if (const auto pixel = camera.project(p_C)) return *pixel;
  const Eigen::Vector2d direction = p_C.head<2>() / p_C.z();
  return {camera.cx() + camera.fx() * direction.x() * 4.0,
          camera.cy() + camera.fy() * direction.y() * 4.0};
}

void setSide(ProjectedBox& box, int side, const ImagePoint& point, const CameraModel& camera,
             const std::array<Corner, 8>& corners) {
  box.sides[side] = point.pixel[side % 2];
  Eigen::Matrix<double, 2, 3> J_point;
  if (point.corner < 0 || !camera.project(corners[point.corner].p_C, &J_point)) {
    box.exact[side] = false;
    return;
  }
  box.H.row(side) = J_point.row(side % 2) * corners[point.corner].J;
  box.H_pose.row(side) = J_point.row(side % 2) * corners[point.corner].J_pose;
}

std::vector<ImagePoint> imagePoints(const std::array<Corner, 8>& corners,
                                    const CameraModel& camera) {
  std::vector<ImagePoint> points;
  for (int i = 0; i < 8; ++i) {
    const Eigen::Vector3d& a = corners[i].p_C;
    if (a.z() >= kNear) points.push_back({pixelOf(camera, a), i});
    for (int axis = 1; axis < 8; axis <<= 1) {
      const int j = i | axis;
      if (j == i) continue;
      const Eigen::Vector3d& b = corners[j].p_C;
      if ((a.z() >= kNear) == (b.z() >= kNear)) continue;
      const double s = (kNear - a.z()) / (b.z() - a.z());
      points.push_back({pixelOf(camera, a + s * (b - a)), -1});
    }
  }
  return points;
}

}  // namespace

Eigen::Matrix3d uprightRotation(double yaw, const Eigen::Vector3d& up_W) {
  return levelling(up_W).conjugate().toRotationMatrix() * rotationAboutZ(yaw);
}

std::array<Eigen::Vector3d, 8> corners(const State& x, const Eigen::Vector3d& up_W) {
  const Eigen::Matrix3d R_WO = uprightRotation(x[kYaw], up_W);
  std::array<Eigen::Vector3d, 8> result;
  for (int i = 0; i < 8; ++i) {
    const Eigen::Vector3d unit((i & 1) ? 0.5 : -0.5, (i & 2) ? 0.5 : -0.5, (i & 4) ? 0.5 : -0.5);
    result[i] =
        x.head<3>() + R_WO * Eigen::Vector3d(x.segment<3>(kSize).array().exp() * unit.array());
  }
  return result;
}

std::optional<ProjectedBox> projectCuboid(const State& x, const View& view) {
  const Eigen::Matrix3d R_WO = uprightRotation(x[kYaw], view.up_W);
  const Eigen::Matrix3d R_CW = view.T_WC().R().transpose();
  std::array<Corner, 8> all;
  ProjectedBox box;
  box.nearest_m = std::numeric_limits<double>::infinity();
  for (int i = 0; i < 8; ++i) {
    all[i] = makeCorner(i, x, view, R_WO, R_CW);
    box.nearest_m = std::min(box.nearest_m, std::max(all[i].p_C.z(), kNear));
  }
  const auto points = imagePoints(all, *view.camera);
  if (points.empty()) return std::nullopt;
  for (int side = 0; side < 4; ++side) {
    const ImagePoint* extreme = &points.front();
    for (const auto& point : points) {
      const double d = point.pixel[side % 2] - extreme->pixel[side % 2];
      if (side < 2 ? d < 0 : d > 0) extreme = &point;
    }
    setSide(box, side, *extreme, *view.camera, all);
  }
  for (const auto& point : points) box.points.push_back(point.pixel);
  return box;
}

std::optional<ProjectedBox> projectObserved(const State& x, const View& view,
                                            const Eigen::Vector4d& offset) {
  auto box = projectCuboid(x, view);
  if (!box) return box;
  const ProjectedBox plain = *box;
  const double limit[2] = {2.0 * view.camera->width(), 2.0 * view.camera->height()};
  for (int i = 0; i < 4; ++i) {
    const int low = i % 2, high = low + 2;
    const double extent = plain.sides[high] - plain.sides[low];
    const double b = x[kBias + i] + offset[i];
    box->sides[i] += b * std::min(extent, limit[low]);
    box->H(i, kBias + i) = std::min(extent, limit[low]);
    if (extent >= limit[low]) continue;
    box->H.row(i) += b * (plain.H.row(high) - plain.H.row(low));
    box->H_pose.row(i) += b * (plain.H_pose.row(high) - plain.H_pose.row(low));
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
