// Convex polygons: hull (Andrew's monotone chain), area, clipping (Sutherland and Hodgman).
#pragma once

#include <Eigen/Core>

#include "common/base/inplace_vector.h"

namespace perdure::semantic_filter {

/// Largest number of points of an outline: corners of a shape, or of a cuboid that the near plane
/// cuts.
inline constexpr std::size_t kMostOutline = 24;
/// A polygon with room for the points that clipping at the four image borders adds.
using Polygon = InplaceVector<Eigen::Vector2d, kMostOutline + 8>;

/// Returns twice the signed area of the triangle o, a, b.
double cross(const Eigen::Vector2d& o, const Eigen::Vector2d& a, const Eigen::Vector2d& b);
/// Returns the convex hull, counter-clockwise if y points up. It is empty if a point is not finite.
Polygon convexHull(Polygon points);
double polygonArea(const Polygon& polygon);
/// Returns the solid angle in steradians of a convex polygon on the plane z = 1, seen from the
/// origin (Van Oosterom and Strackee, IEEE T-BME 1983, eq. 8). Its points are (x, y).
double solidAngle(const Polygon& polygon);
/// Returns the part of a convex polygon with coordinate `axis` >= at (or <= at).
Polygon clip(const Polygon& polygon, int axis, double at, bool keep_greater);

}  // namespace perdure::semantic_filter
