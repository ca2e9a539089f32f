#include "services/gateway/mcp/looked.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include "common/math/so3.h"
#include "services/gateway/mcp/objects.h"

namespace perdure::gateway::mcp {
namespace {

constexpr int kHalf = 12;  // cells from the centre of a disc to its border

/// Whether the segment from a to b crosses the rectangle |x| <= half.x, |y| <= half.y.
bool crosses(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& half) {
  double from = 0.0, to = 1.0;
  for (int axis = 0; axis < 2; ++axis) {
    const double slope = b[axis] - a[axis];
    double in = (-half[axis] - a[axis]) / slope, out = (half[axis] - a[axis]) / slope;
    if (slope == 0.0) {
      if (std::abs(a[axis]) > half[axis]) return false;
      continue;
    }
    if (in > out) std::swap(in, out);
    from = std::max(from, in);
    to = std::min(to, out);
  }
  return from < to;
}

/// Returns the distance up to which nine of ten objects near a place were detected; 0: not known.
double reachAt(Map& map, const Eigen::Vector2d& place) {
  MapQuery query;
  query.kind = MapQueryKind::kByRadius;
  query.low << place, 0.0;
  query.radius = 1e6;
  query.limit = kMostInFull;
  std::vector<float> reaches;
  for (const MapObject& object : map.ask(query).objects) {
    const auto belief = beliefOf(map, object.id);
    const float reach = belief ? belief->seen_from.maxCoeff() : 0.0F;
    if (reach > 0.0F) reaches.push_back(reach);
  }
  if (reaches.empty()) return 0.0;
  const auto at = reaches.begin() + static_cast<std::ptrdiff_t>(9 * (reaches.size() - 1) / 10);
  std::ranges::nth_element(reaches, at);
  return *at;
}

}  // namespace

struct Looked::Cell {
  std::pair<int, int> at;  ///< column and row
  Eigen::Vector2d centre;
  double area_m2 = 0.0, share = 0.0;  ///< share of its area that was never looked at
};

Looked::Looked(Map& map, const State& state, const Conditions& conditions)
    : cameras_(state.cameras), reach_m_(reachAt(map, *conditions.near)) {
  if (cameras_.empty()) {
    throw NoAnswer(
        "The map does not have the cameras' fields of view: it is of an earlier version, or there "
        "was no calibration. Drive with this version to store them.");
  }
  if (reach_m_ <= 0.0) {
    throw NoAnswer("The map has no objects, so it is not known how far the camera detects them.");
  }
  MapQuery query;
  query.kind = MapQueryKind::kGraph;
  query.low << *conditions.near, 0.0;
  query.limit = kMostListed;
  anchors_ = map.ask(query).anchors;
  const double around = std::max(conditions.radius_m, reach_m_) + reach_m_;
  std::erase_if(anchors_, [&](const MapAnchor& anchor) {
    return (anchor.p.head<2>() - *conditions.near).norm() > around;
  });
  objects_ = objectsIn(map, *conditions.near, around).objects;
}

std::optional<double> Looked::density(const Conditions& conditions) const {
  const double radius = std::max(conditions.radius_m, reach_m_);
  const double seen_m2 = std::numbers::pi * radius * radius - unseenArea(*conditions.near, radius);
  if (seen_m2 < 1.0) return std::nullopt;
  double count = 0.0;
  for (const MapObject& each : objects_) {
    const bool inside = (each.mean.head<2>() - *conditions.near).norm() <= radius;
    if (inside && conditions.matchesClass(each.class_name)) {
      count += each.existence * each.class_probability;
    }
  }
  return count / seen_m2;
}

bool Looked::isHidden(const Eigen::Vector3d& from, const Eigen::Vector2d& p) const {
  return std::ranges::any_of(objects_, [&](const MapObject& object) {
    const Eigen::Vector3d half = 0.5 * object.mean.tail<3>().array().exp();
    const bool in_height = std::abs(object.mean[2] - from.z()) < half.z();
    if (!in_height || object.existence < 0.5) return false;
    const Eigen::Matrix2d R_OM = Eigen::Rotation2Dd(-object.mean[3]).toRotationMatrix();
    const Eigen::Vector2d end = R_OM * (p - object.mean.head<2>());
    const bool inside = (end.array().abs() <= half.head<2>().array()).all();
    return !inside && crosses(R_OM * (from.head<2>() - object.mean.head<2>()), end, half.head<2>());
  });
}

bool Looked::at(const Eigen::Vector2d& p) const {
  return std::ranges::any_of(anchors_, [&](const MapAnchor& anchor) {
    const Eigen::Vector2d ray = p - anchor.p.head<2>();
    if (ray.norm() > reach_m_) return false;
    const double azimuth = std::atan2(ray.y(), ray.x()) - anchor.yaw;
    const bool in_view = std::ranges::any_of(cameras_, [&](const mapping::Sight& sight) {
      return std::abs(wrapAngle(azimuth - sight.azimuth)) < sight.half_width;
    });
    return in_view && !isHidden(anchor.p, p);
  });
}

/// Returns the cells of a disc. Each is tested at four points.
std::vector<Looked::Cell> Looked::cellsOf(const Eigen::Vector2d& centre, double radius_m) const {
  const double side = radius_m / kHalf;
  std::vector<Cell> cells;
  for (int x = -kHalf; x < kHalf; ++x) {
    for (int y = -kHalf; y < kHalf; ++y) {
      const Eigen::Vector2d offset = side * Eigen::Vector2d(x + 0.5, y + 0.5);
      if (offset.norm() > radius_m) continue;
      Cell cell{{x, y}, centre + offset, side * side, 0.0};
      for (const double dx : {-0.25, 0.25}) {
        for (const double dy : {-0.25, 0.25}) {
          if (!at(cell.centre + side * Eigen::Vector2d(dx, dy))) cell.share += 0.25;
        }
      }
      cells.push_back(cell);
    }
  }
  return cells;
}

double Looked::unseenArea(const Eigen::Vector2d& centre, double radius_m) const {
  double area = 0.0;
  for (const Cell& cell : cellsOf(centre, radius_m)) area += cell.share * cell.area_m2;
  return area;
}

std::vector<Looked::Region> Looked::unseen(const Eigen::Vector2d& centre, double radius_m) const {
  std::map<std::pair<int, int>, Cell> open;
  for (const Cell& cell : cellsOf(centre, radius_m)) {
    if (cell.share >= 0.5) open.emplace(cell.at, cell);
  }
  std::vector<Region> regions;
  while (!open.empty()) {
    std::vector<Cell> front{open.begin()->second};
    open.erase(open.begin());
    Region region;
    while (!front.empty()) {
      const Cell cell = front.back();
      front.pop_back();
      region.centre += cell.area_m2 * cell.centre;
      region.share += cell.area_m2 * cell.share;
      region.area_m2 += cell.area_m2;
      for (const auto& [dx, dy] : {std::pair(-1, 0), {1, 0}, {0, -1}, {0, 1}}) {
        const auto next = open.find({cell.at.first + dx, cell.at.second + dy});
        if (next == open.end()) continue;
        front.push_back(next->second);
        open.erase(next);
      }
    }
    region.centre /= region.area_m2;
    region.share /= region.area_m2;
    regions.push_back(region);
  }
  std::ranges::sort(regions, std::greater{}, &Region::area_m2);
  return regions;
}

}  // namespace perdure::gateway::mcp
