// Convex polygons in a plane: hull, area and cutting, for outlines in the image and footprints.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace perdure::semantic_filter {

using Polygon = std::vector<Eigen::Vector2d>;

/// Twice the signed area of the triangle o, a, b.
double cross(const Eigen::Vector2d& o, const Eigen::Vector2d& a, const Eigen::Vector2d& b);
/// Convex hull by Andrew's monotone chain, counter-clockwise where y points up. Not empty input.
Polygon convexHull(Polygon points);
double polygonArea(const Polygon& polygon);
/// The part of a convex polygon with coordinate `axis` >= at (or <= at), by Sutherland-Hodgman.
Polygon clip(const Polygon& polygon, int axis, double at, bool keep_greater);

}  // namespace perdure::semantic_filter
