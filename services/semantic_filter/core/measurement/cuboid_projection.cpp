#include "services/semantic_filter/core/measurement/cuboid_projection.h"

#include <algorithm>
#include <cmath>

#include "common/math/so3.h"
#include "services/semantic_filter/core/measurement/cuboid_corners.h"
#include "services/semantic_filter/core/measurement/image_border.h"

namespace perdure::semantic_filter {

namespace {

enum class Part { kWhole, kWithinImage };

std::optional<ProjectedBox> projectPart(Part part, const State& x, const Projector& from,
                                        const Shape& shape, double heading) {
  std::optional<ProjectedBox> result;
  Corners corners;
  if (!cornersBeforeCamera(x, from, shape, heading, corners)) return result;
  ProjectedBox& box = result.emplace();
  ImagePoints points;
  projectCorners(corners, *from.camera, points);
  box.sides = points.sides;
  for (int side = 0; side < 4; ++side) {
    setSide(box, side, points.at(side % 2 == 0 ? points.u : points.v, box.sides[side]), from,
            corners);
  }
  if (part == Part::kWithinImage) endWithinImage(box, corners, points, from);
  return result;
}

}  // namespace

std::optional<ProjectedBox> projectCuboid(const State& x, const Projector& from, const Shape& shape,
                                          double heading) {
  return projectPart(Part::kWhole, x, from, shape, heading);
}

std::optional<ProjectedOutline> projectOutline(const State& x, const Projector& from,
                                               const Shape& shape) {
  std::optional<ProjectedOutline> result;
  Corners corners;
  if (!cornersBeforeCamera(x, from, shape, 0.0, corners)) return result;
  ProjectedOutline& outline = result.emplace();
  ImagePoints points;
  projectCorners(corners, *from.camera, points);
  outline.sides = points.sides;
  outline.points.resize(points.size);
  for (std::size_t i = 0; i < points.size; ++i) {
    outline.points[i] = {points.u[i], points.v[i]};
  }
  return result;
}

std::optional<ProjectedBox> projectObserved(const State& x, const Projector& from,
                                            const BoxStyle& style, double heading) {
  auto box = projectPart(Part::kWithinImage, x, from, style.shape, heading);
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
