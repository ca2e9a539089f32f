// Shape of an object in its cuboid: level outlines with cut corners. A car stands on wheels, and
// its corners and its roof are round. Derivation: tools/docs/maths/cuboid_projection.md.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <vector>

namespace perdure::semantic_filter {

/// A level outline of the object: a rectangle with cut corners.
struct ShapeLevel {
  double height = 0.0;               ///< -1 (the ground) to 1 (the top)
  double along = 1.0, across = 1.0;  ///< in halves of length and width, (0, 1]
  double corner = 1.0;               ///< start of the cut, in halves of each side; 1: no cut
  /// forward offset of its middle from the cuboid's middle, in halves of the length
  double forward = 0.0;
};

/// The corners of a convex solid. The image of the object is the convex hull of their images.
struct Shape {
  static constexpr int kMostLevels = 3, kMostCorners = 8 * kMostLevels;
  using PerCorner = Eigen::Array<double, Eigen::Dynamic, 1, 0, kMostCorners, 1>;

  PerCorner along, across, up;  ///< from the middle, in halves of length, width and height, -1 to 1
  PerCorner forward;            ///< added to `along`, times the heading
  bool is_cuboid = false;

  int corners() const { return static_cast<int>(along.size()); }
  /// Returns corner i. `heading`: 1 if the object faces along its yaw, -1 if it faces the other
  /// way, 0 if unknown.
  Eigen::Vector3d corner(int i, double heading) const {
    return {along[i] + heading * forward[i], across[i], up[i]};
  }
};

/// Returns the expected heading, -1 to 1, from the log-odds that the yaw is not turned by 180°.
inline double headingOf(double log_odds) { return std::tanh(0.5 * log_odds); }

/// Returns the whole cuboid. Bit i of a corner's number is set on the positive side of axis i.
const Shape& cuboidShape();
/// Returns the shape with these levels, at most Shape::kMostLevels.
Shape shapeOf(const std::vector<ShapeLevel>& levels);

}  // namespace perdure::semantic_filter
