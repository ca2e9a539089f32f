// Upright boxes around objects, and a test for their intersection. No two objects of a scene may
// intersect.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "common/sim/scene.h"

namespace perdure::sim {

/// A box rotated about the vertical only. Metres, W.
struct Solid {
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();
  double yaw = 0.0;
  Eigen::Vector2d half = Eigen::Vector2d::Zero();  ///< half of length and width
  double low = 0.0, high = 0.0;                    ///< z

  std::array<Eigen::Vector2d, 4> corners() const;
};

/// The largest gap between the two along their separating directions. It is a lower bound of the
/// distance; negative values mean an overlap of at least that size.
double gapBetween(const Solid& a, const Solid& b);
bool meet(const Solid& a, const Solid& b, double margin = 0.0);
/// Distance on the ground from a point to the outline; 0 inside.
double distanceTo(const Solid& solid, const Eigen::Vector2d& point);

/// Returns whether the straight line from `from` to `to` (W) passes through the solid.
bool blocks(const Solid& solid, const Eigen::Vector3d& from, const Eigen::Vector3d& to);

Solid solidOf(const SceneObject& object, double t_s);
/// The solids of a prop: a thin trunk and a crown for a tree, one box for other props.
std::vector<Solid> solidsOf(const Prop& prop);

}  // namespace perdure::sim
