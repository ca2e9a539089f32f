#include "services/semantic_filter/core/measurement/polygon.h"

#include <algorithm>
#include <cmath>

namespace perdure::semantic_filter {

double cross(const Eigen::Vector2d& o, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return (a.x() - o.x()) * (b.y() - o.y()) - (a.y() - o.y()) * (b.x() - o.x());
}

Polygon convexHull(Polygon points) {
  const bool finite = std::all_of(points.begin(), points.end(),
                                  [](const Eigen::Vector2d& p) { return p.allFinite(); });
  if (points.empty() || !finite) return {};
  std::sort(points.begin(), points.end(), [](const auto& a, const auto& b) {
    return a.x() < b.x() || (a.x() == b.x() && a.y() < b.y());
  });
  InplaceVector<Eigen::Vector2d, 2 * (kMostOutline + 8) + 1> hull;
  hull.resize(2 * points.size() + 1);
  std::size_t k = 0;
  const auto extend = [&](const Eigen::Vector2d& p, std::size_t floor) {
    while (k >= floor + 2 && cross(hull[k - 2], hull[k - 1], p) <= 0) --k;
    hull[k++] = p;
  };
  for (const auto& p : points) extend(p, 0);
  const std::size_t lower = k - 1;
  for (std::size_t i = points.size() - 1; i-- > 0;) extend(points[i], lower);
  Polygon result;
  for (std::size_t i = 0; i < (k > 1 ? k - 1 : k); ++i) result.push_back(hull[i]);
  return result;
}

double polygonArea(const Polygon& p) {
  double twice = 0.0;
  for (std::size_t i = 0; i < p.size(); ++i) {
    const auto& a = p[i];
    const auto& b = p[(i + 1) % p.size()];
    twice += a.x() * b.y() - b.x() * a.y();
  }
  return 0.5 * std::abs(twice);
}

double solidAngle(const Polygon& p) {
  double sum = 0.0;
  const auto ray = [&](std::size_t i) { return p[i].homogeneous().normalized(); };
  for (std::size_t i = 2; i < p.size(); ++i) {
    const Eigen::Vector3d a = ray(0), b = ray(i - 1), c = ray(i);
    sum += 2.0 * std::atan2(a.dot(b.cross(c)), 1.0 + a.dot(b) + b.dot(c) + c.dot(a));
  }
  return std::abs(sum);
}

Polygon clip(const Polygon& p, int axis, double at, bool keep_greater) {
  Polygon result;
  const auto inside = [&](const Eigen::Vector2d& a) {
    return keep_greater ? a[axis] >= at : a[axis] <= at;
  };
  for (std::size_t i = 0; i < p.size(); ++i) {
    const auto& a = p[i];
    const auto& b = p[(i + 1) % p.size()];
    if (inside(a)) result.push_back(a);
    if (inside(a) != inside(b))
      result.push_back(a + (at - a[axis]) / (b[axis] - a[axis]) * (b - a));
  }
  return result;
}

}  // namespace perdure::semantic_filter
