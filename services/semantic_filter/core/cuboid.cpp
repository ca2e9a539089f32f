#include "services/semantic_filter/core/cuboid.h"

#include <cmath>

#include "common/math/so3.h"

namespace perdure::semantic_filter {
namespace {

constexpr double kNear = 0.2;  // metres

/// The cuboid and its eight corners before the camera.
struct Corners {
  Eigen::Matrix3d R_WO, R_CW, R_CB;
  Eigen::Vector3d size;                  ///< length, width, height
  std::array<Eigen::Vector3d, 8> local;  ///< from the centre, along the cuboid's axes
  std::array<Eigen::Vector3d, 8> p_C;
};

struct ImagePoint {
  Eigen::Vector2d pixel;
  int corner;  ///< -1: a cut by the near plane
};

Eigen::Vector3d cornerOf(int i, const Eigen::Vector3d& size) {
  return {(i & 1) ? 0.5 * size.x() : -0.5 * size.x(), (i & 2) ? 0.5 * size.y() : -0.5 * size.y(),
          (i & 4) ? 0.5 * size.z() : -0.5 * size.z()};
}

/// Nothing where all of it lies behind the near plane.
std::optional<Corners> cornersBeforeCamera(const State& x, const View& view) {
  Corners c;
  const RigidTransform T_WC = view.T_WC();
  c.R_CW = T_WC.q.conjugate().toRotationMatrix();
  const Eigen::Vector3d centre_C = c.R_CW * (x.head<3>() - T_WC.p);
  c.size = x.segment<3>(kSize).array().exp();
  if (centre_C.z() + 0.5 * c.size.norm() < kNear) return std::nullopt;
  c.R_CB = view.camera->T_BC().q.conjugate().toRotationMatrix();
  c.R_WO = uprightRotation(x[kYaw], view.up_W);
  const Eigen::Matrix3d R_CO = c.R_CW * c.R_WO;
  bool any = false;
  for (int i = 0; i < 8; ++i) {
    c.local[i] = cornerOf(i, c.size);
    c.p_C[i] = centre_C + R_CO * c.local[i];
    any = any || c.p_C[i].z() >= kNear;
  }
  if (!any) return std::nullopt;
  return c;
}

/// Pixel of a point in front; far outside the image where the distortion is not defined.
Eigen::Vector2d pixelOf(const CameraModel& camera, const Eigen::Vector3d& p_C) {
  if (const auto pixel = camera.project(p_C)) return *pixel;
  const Eigen::Vector2d direction = p_C.head<2>() / p_C.z();
  return {camera.cx() + camera.fx() * direction.x() * 4.0,
          camera.cy() + camera.fy() * direction.y() * 4.0};
}

void setSide(ProjectedBox& box, int side, const ImagePoint& point, const View& view,
             const Corners& corners) {
  box.sides[side] = point.pixel[side % 2];
  Eigen::Matrix<double, 2, 3> J_point;
  if (point.corner < 0 || !view.camera->project(corners.p_C[point.corner], &J_point)) {
    box.exact[side] = false;
    return;
  }
  const Eigen::Vector3d& local = corners.local[point.corner];
  const Eigen::RowVector3d by_C = J_point.row(side % 2);
  const Eigen::RowVector3d by_W = by_C * corners.R_CW;
  const Eigen::RowVector3d by_O = by_W * corners.R_WO;
  box.H.row(side).head<3>() = by_W;
  box.H(side, kYaw) = by_O.y() * local.x() - by_O.x() * local.y();  // turns x towards y
  box.H.row(side).segment<3>(kSize) = by_O.cwiseProduct(local.transpose());
  const Eigen::Vector3d p_B =
      corners.R_CB.transpose() * corners.p_C[point.corner] + view.camera->T_BC().p;
  const Eigen::Vector3d by_B = (by_C * corners.R_CB).transpose();
  box.H_pose.row(side).head<3>() = by_B.cross(p_B).transpose();
  box.H_pose.row(side).tail<3>() = -by_W;
}

using ImagePoints = InplaceVector<ImagePoint, kMostOutline>;

ImagePoints imagePoints(const Corners& corners, const CameraModel& camera) {
  ImagePoints points;
  for (int i = 0; i < 8; ++i) {
    const Eigen::Vector3d& a = corners.p_C[i];
    if (a.z() >= kNear) points.push_back({pixelOf(camera, a), i});
    for (int axis = 1; axis < 8; axis <<= 1) {
      const int j = i | axis;
      if (j == i) continue;
      const Eigen::Vector3d& b = corners.p_C[j];
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

std::optional<ProjectedBox> projectCuboid(const State& x, const View& view) {
  const auto corners = cornersBeforeCamera(x, view);
  if (!corners) return std::nullopt;
  std::optional<ProjectedBox> result(std::in_place);
  ProjectedBox& box = *result;
  const auto points = imagePoints(*corners, *view.camera);
  for (int side = 0; side < 4; ++side) {
    const ImagePoint* extreme = &points[0];
    for (const auto& point : points) {
      const double d = point.pixel[side % 2] - extreme->pixel[side % 2];
      if (side < 2 ? d < 0 : d > 0) extreme = &point;
    }
    setSide(box, side, *extreme, view, *corners);
  }
  for (const auto& point : points) box.points.push_back(point.pixel);
  return result;
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
