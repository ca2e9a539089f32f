// What a thing fills of its cuboid: a car stands on wheels, and its corners and its roof are round.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <vector>

namespace perdure::semantic_filter {

/// A level outline of the thing: a rectangle whose corners are cut.
struct ShapeLevel {
  double height = 0.0;               ///< -1 (the ground) … 1 (the top)
  double along = 1.0, across = 1.0;  ///< of half the length and half the width, (0, 1]
  double corner = 1.0;               ///< where the cut begins, of each side's half; 1: a rectangle
  double forward = 0.0;  ///< of half the length: its middle is so far before the cuboid's
};

/// The corners of a convex solid; the image of its hull is the thing's.
struct Shape {
  static constexpr int kMostLevels = 3, kMostCorners = 8 * kMostLevels;
  /// A number for each corner.
  using PerCorner = Eigen::Array<double, Eigen::Dynamic, 1, 0, kMostCorners, 1>;

  PerCorner along, across, up;  ///< in halves of length, width and height from the middle, -1 … 1
  PerCorner forward;  ///< what is added to `along` of a thing that surely faces where its yaw says
  bool is_cuboid = false;

  int corners() const { return static_cast<int>(along.size()); }
  /// `heading`: 1, where its yaw says; -1, the other way; 0, either.
  Eigen::Vector3d corner(int i, double heading) const {
    return {along[i] + heading * forward[i], across[i], up[i]};
  }
};

/// What is expected where it faces as its yaw says by these log-odds.
inline double headingOf(double log_odds) { return std::tanh(0.5 * log_odds); }

/// Bit i of a corner's number is set on the far side of axis i.
const Shape& cuboidShape();
/// At most Shape::kMostLevels of them.
Shape shapeOf(const std::vector<ShapeLevel>& levels);

}  // namespace perdure::semantic_filter
