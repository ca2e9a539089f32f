// Upright boxes around objects, and tests of their intersection. No two objects of a scene may
// intersect.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "common/sim/scene.h"

namespace perdure::sim {

/// A box in W, in metres, that is rotated about the vertical only.
struct Solid {
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();
  double yaw = 0.0;
  Eigen::Vector2d half = Eigen::Vector2d::Zero();  ///< half of length and width
  double low = 0.0, high = 0.0;                    ///< z

  std::array<Eigen::Vector2d, 4> corners() const;
};

/// The largest gap between the two boxes along their separating axes. It is a lower bound of their
/// distance; a negative value is the overlap.
double gapBetween(const Solid& a, const Solid& b);
bool meet(const Solid& a, const Solid& b, double margin = 0.0);
/// Distance on the ground from a point to the box; 0 inside.
double distanceTo(const Solid& solid, const Eigen::Vector2d& point);

/// Whether the straight line from `from` to `to` (in W) passes through the box.
bool blocks(const Solid& solid, const Eigen::Vector3d& from, const Eigen::Vector3d& to);

Solid solidOf(const SceneObject& object, double t_s);
/// The boxes of a prop: a thin trunk and a crown for a tree, one box for any other prop.
std::vector<Solid> solidsOf(const Prop& prop);

}  // namespace perdure::sim
