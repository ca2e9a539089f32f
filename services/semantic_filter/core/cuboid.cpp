#include "services/semantic_filter/core/cuboid.h"

#include <cmath>

#include "common/math/so3.h"

namespace perdure::semantic_filter {
namespace {

constexpr double kNear = 0.2;  // metres

/// The corners of a shape before the camera.
struct Corners {
  Eigen::Matrix3d R_WO;
  Eigen::Vector3d half;  ///< of length, width, height
  const Shape* shape = nullptr;
  InplaceVector<Eigen::Vector3d, Shape::kMostPoints> p_C;
  bool any_before = false, all_before = true;  ///< the near plane

  /// From the centre, along the cuboid's axes.
  Eigen::Vector3d local(int i) const {
    return half.cwiseProduct(shape->points[static_cast<std::size_t>(i)]);
  }
};

struct ImagePoint {
  Eigen::Vector2d pixel;
  int corner;  ///< -1: a cut by the near plane
};

/// Nothing where all of it lies behind the near plane. What reaches it is the cuboid, whose edges
/// are cut there.
std::optional<Corners> cornersBeforeCamera(const State& x, const Projector& from,
                                           const Shape& shape) {
  const Eigen::Vector3d centre_C = from.R_CW * (x.head<3>() - from.T_WC.p);
  const Eigen::Vector3d half = 0.5 * x.segment<3>(kSize).array().exp();
  const double reach = half.norm();
  if (centre_C.z() + reach < kNear) return std::nullopt;
  std::optional<Corners> result(std::in_place);
  Corners& c = *result;
  c.half = half;
  c.shape = centre_C.z() - reach < kNear ? &cuboidShape() : &shape;
  c.R_WO = from.R_WL * rotationAboutZ(x[kYaw]);
  const Eigen::Matrix3d R_CO = from.R_CW * c.R_WO;
  const Eigen::Vector3d along = half.x() * R_CO.col(0), across = half.y() * R_CO.col(1),
                        up = half.z() * R_CO.col(2);
  for (const Eigen::Vector3d& u : c.shape->points) {
    c.p_C.push_back(((centre_C + u.x() * along) + u.y() * across) + u.z() * up);
    const bool before = c.p_C[c.p_C.size() - 1].z() >= kNear;
    c.any_before = c.any_before || before;
    c.all_before = c.all_before && before;
  }
  if (!c.any_before) return std::nullopt;
  return result;
}

/// Pixel of a point in front; far outside the image where the distortion is not defined.
Eigen::Vector2d pixelOf(const CameraModel& camera, const Eigen::Vector3d& p_C) {
  if (const auto pixel = camera.project(p_C)) return *pixel;
  const Eigen::Vector2d direction = p_C.head<2>() / p_C.z();
  return {camera.cx() + camera.fx() * direction.x() * 4.0,
          camera.cy() + camera.fy() * direction.y() * 4.0};
}

void setSide(ProjectedBox& box, int side, const ImagePoint& point, const Projector& from,
             const Corners& corners) {
  box.sides[side] = point.pixel[side % 2];
  Eigen::Matrix<double, 2, 3> J_point;
  if (point.corner < 0 ||
      !from.camera->project(corners.p_C[static_cast<std::size_t>(point.corner)], &J_point)) {
    box.exact[side] = false;
    return;
  }
  const Eigen::Vector3d local = corners.local(point.corner);
  const Eigen::RowVector3d by_C = J_point.row(side % 2);
  const Eigen::RowVector3d by_W = by_C * from.R_CW;
  const Eigen::RowVector3d by_O = by_W * corners.R_WO;
  box.H.row(side).head<3>() = by_W;
  box.H(side, kYaw) = by_O.y() * local.x() - by_O.x() * local.y();  // turns x towards y
  box.H.row(side).segment<3>(kSize) = by_O.cwiseProduct(local.transpose());
  const Eigen::Vector3d& p_C = corners.p_C[static_cast<std::size_t>(point.corner)];
  const Eigen::Vector3d p_B = from.R_BC * p_C + from.camera->T_BC().p;
  const Eigen::Vector3d by_B = from.R_BC * by_C.transpose();
  box.H_pose.row(side).head<3>() = by_B.cross(p_B).transpose();
  box.H_pose.row(side).tail<3>() = -by_W;
}

using ImagePoints = InplaceVector<ImagePoint, kMostOutline>;

/// Of the cuboid's edges.
void addCuts(ImagePoints& points, std::size_t i, const Corners& corners,
             const CameraModel& camera) {
  const Eigen::Vector3d& a = corners.p_C[i];
  for (std::size_t axis = 1; axis < 8; axis <<= 1) {
    const std::size_t j = i | axis;
    if (j == i) continue;
    const Eigen::Vector3d& b = corners.p_C[j];
    if ((a.z() >= kNear) == (b.z() >= kNear)) continue;
    const double s = (kNear - a.z()) / (b.z() - a.z());
    points.push_back({pixelOf(camera, a + s * (b - a)), -1});
  }
}

ImagePoints imagePoints(const Corners& corners, const CameraModel& camera) {
  ImagePoints points;
  for (std::size_t i = 0; i < corners.p_C.size(); ++i) {
    const Eigen::Vector3d& a = corners.p_C[i];
    if (a.z() >= kNear) points.push_back({pixelOf(camera, a), static_cast<int>(i)});
    if (!corners.all_before) addCuts(points, i, corners, camera);
  }
  return points;
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

std::optional<ProjectedBox> projectCuboid(const State& x, const Projector& from,
                                          const Shape& shape) {
  std::optional<ProjectedBox> result;
  const auto corners = cornersBeforeCamera(x, from, shape);
  if (!corners) return result;
  ProjectedBox& box = result.emplace();
  const auto points = imagePoints(*corners, *from.camera);
  for (int side = 0; side < 4; ++side) {
    const ImagePoint* extreme = &points[0];
    for (const auto& point : points) {
      const double d = point.pixel[side % 2] - extreme->pixel[side % 2];
      if (side < 2 ? d < 0 : d > 0) extreme = &point;
    }
    setSide(box, side, *extreme, from, *corners);
  }
  for (const auto& point : points) box.points.push_back(point.pixel);
  return result;
}

std::optional<ProjectedBox> projectObserved(const State& x, const Projector& from,
                                            const BoxStyle& style) {
  auto box = projectCuboid(x, from, style.shape);
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
