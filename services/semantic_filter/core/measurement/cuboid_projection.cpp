#include "services/semantic_filter/core/measurement/cuboid_projection.h"

#include <algorithm>
#include <cmath>

#include "common/math/so3.h"
#include "services/semantic_filter/core/measurement/cuboid_corners.h"

namespace perdure::semantic_filter {

namespace {

/// The part in front of the near plane of a line from corner a to corner b, in shares of the line.
struct Segment {
  int a, b;
  double from = 0.0, to = 1.0;
};

std::optional<Segment> beforeNearPlane(int a, int b, const Corners& corners) {
  const double z_a = corners.p_C(a).z(), z_b = corners.p_C(b).z();
  if (z_a < kNear && z_b < kNear) return std::nullopt;
  Segment segment{a, b};
  if (z_a < kNear) segment.from = (kNear - z_a) / (z_b - z_a);
  if (z_b < kNear) segment.to = (kNear - z_a) / (z_b - z_a);
  return segment;
}

/// Returns the share of a line at which it crosses a border, px, by the method of false position.
/// Without distortion the first step is exact. Returns nothing if the line does not cross.
std::optional<double> crossing(const Segment& segment, const Corners& corners,
                               const CameraModel& camera, int axis, double border) {
  const Eigen::Vector3d a = corners.p_C(segment.a), way = corners.p_C(segment.b) - a;
  const auto beyond = [&](double s) {
    const Eigen::Vector3d p = a + s * way;
    return p.z() * (pixelOf(camera, p)[axis] - border);
  };
  double s0 = segment.from, s1 = segment.to, f0 = beyond(s0), f1 = beyond(s1);
  if ((f0 < 0.0) == (f1 < 0.0)) return std::nullopt;
  double s = s0;
  for (int i = 0; i < 8; ++i) {
    s = s0 + (s1 - s0) * f0 / (f0 - f1);
    const double f = beyond(s);
    if (std::abs(f) < 1e-6) break;
    const bool first = (f < 0.0) == (f0 < 0.0);
    (first ? s0 : s1) = s;
    (first ? f0 : f1) = f;
  }
  return s;
}

/// Returns the point at which a line between corners crosses the border. Its derivative is that
/// along the border, because it stays on the border. Returns nothing if it is not defined.
std::optional<SidePoint> crossingPoint(const Segment& segment, double s, const Corners& corners,
                                       const CameraModel& camera, int axis) {
  const Eigen::Vector3d a = corners.p_C(segment.a), way = corners.p_C(segment.b) - a;
  SidePoint point{
      a + s * way, (1.0 - s) * corners.local(segment.a) + s * corners.local(segment.b), {}};
  Eigen::RowVector3d across, along;
  if (!coordinateByPoint(camera, point.p_C, axis, across) ||
      !coordinateByPoint(camera, point.p_C, 1 - axis, along)) {
    return std::nullopt;
  }
  const double crosses = across.dot(way);
  if (std::abs(crosses) < 1e-9) return std::nullopt;
  point.by_C = along - along.dot(way) / crosses * across;
  return point;
}

/// The part of the object within the borders of one image axis, and its ends along the other axis.
class EndsWithin {
 public:
  EndsWithin(const Corners& corners, const ImagePoints& points, const CameraModel& camera, int axis)
      : axis_(axis) {
    const double extent = axis == 0 ? camera.width() : camera.height();
    const auto& across = axis == 0 ? points.u : points.v;
    const auto& along = axis == 0 ? points.v : points.u;
    for (std::size_t i = 0; i < points.size; ++i) {
      if (across[i] < 0.0 || across[i] > extent) continue;
      const int corner = points.in_order ? static_cast<int>(i) : points.corner[i];
      consider({along[i], corner, {}, 0.0});
    }
    for (int a = 0; a < corners.shape->corners(); ++a) {
      for (int b = 0; b < a; ++b) {
        const auto segment = beforeNearPlane(a, b, corners);
        if (!segment) continue;
        for (const double border : {0.0, extent}) {
          const auto s = crossing(*segment, corners, camera, axis, border);
          if (!s) continue;
          const Eigen::Vector3d p = corners.p_C(a) + *s * (corners.p_C(b) - corners.p_C(a));
          consider({pixelOf(camera, p)[1 - axis], kCut, segment, *s});
        }
      }
    }
  }

  void set(ProjectedBox& box, const Projector& from, const Corners& corners) const {
    if (!least_ || !most_) return;
    setEnd(box, 1 - axis_, *least_, from, corners);
    setEnd(box, 3 - axis_, *most_, from, corners);
  }

 private:
  struct End {
    double at;
    int corner;
    std::optional<Segment> segment;
    double share;
  };
  void consider(const End& end) {
    if (!least_ || end.at < least_->at) least_ = end;
    if (!most_ || end.at > most_->at) most_ = end;
  }
  void setEnd(ProjectedBox& box, int side, const End& end, const Projector& from,
              const Corners& corners) const {
    box.sides[side] = end.at;
    const auto point = end.segment
                           ? crossingPoint(*end.segment, end.share, corners, *from.camera, axis_)
                           : std::nullopt;
    if (point) {
      setSide(box, side, *point, from, corners);
    } else {
      setSide(box, side, end.corner, from, corners);
    }
  }

  int axis_;
  std::optional<End> least_, most_;
};

/// If the border cuts the object, moves the other sides of its box to the part inside.
void endWithinImage(ProjectedBox& box, const Corners& corners, const ImagePoints& points,
                    const Projector& from) {
  const Eigen::Vector4d whole = box.sides;
  for (int axis = 0; axis < 2; ++axis) {
    const double extent = axis == 0 ? from.camera->width() : from.camera->height();
    const double low = whole[axis], high = whole[axis + 2];
    const bool cut = (low < 0.0 && high > 0.0) || (low < extent && high > extent);
    if (cut) EndsWithin(corners, points, *from.camera, axis).set(box, from, corners);
  }
}

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
