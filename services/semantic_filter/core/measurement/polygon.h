// Convex polygons in a plane: hull, area and cutting, for outlines in the image and footprints.
#pragma once

#include <Eigen/Core>

#include "common/base/inplace_vector.h"

namespace perdure::semantic_filter {

/// Of points: the images of a shape's corners, or of a cuboid's and of its edges' cuts by the near
/// plane.
inline constexpr std::size_t kMostOutline = 24;
/// With room for the points that cutting at the four borders of an image adds.
using Polygon = InplaceVector<Eigen::Vector2d, kMostOutline + 8>;

/// Twice the signed area of the triangle o, a, b.
double cross(const Eigen::Vector2d& o, const Eigen::Vector2d& a, const Eigen::Vector2d& b);
/// Convex hull by Andrew's monotone chain, counter-clockwise where y points up. Empty where a point
/// is not finite.
Polygon convexHull(Polygon points);
double polygonArea(const Polygon& polygon);
/// The part of a convex polygon with coordinate `axis` >= at (or <= at), by Sutherland-Hodgman.
Polygon clip(const Polygon& polygon, int axis, double at, bool keep_greater);

}  // namespace perdure::semantic_filter
