// Upright boxes that things fill, and whether two of them meet: nothing in a scene interpenetrates.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "common/sim/scene.h"

namespace perdure::sim {

/// A box turned about the vertical only. Metres, W.
struct Solid {
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();
  double yaw = 0.0;
  Eigen::Vector2d half = Eigen::Vector2d::Zero();  ///< of length and width
  double low = 0.0, high = 0.0;                    ///< z

  std::array<Eigen::Vector2d, 4> corners() const;
};

/// The gap between them along the separating direction that shows most of it: a lower bound of the
/// distance, negative where they meet by at least that much.
double gapBetween(const Solid& a, const Solid& b);
bool meet(const Solid& a, const Solid& b, double margin = 0.0);
/// Distance on the ground from a point to the outline; 0 inside.
double distanceTo(const Solid& solid, const Eigen::Vector2d& point);

/// Whether the straight line from `from` to `to` (W) goes through it.
bool blocks(const Solid& solid, const Eigen::Vector3d& from, const Eigen::Vector3d& to);

Solid solidOf(const SceneObject& object, double t_s);
/// What it fills: a tree is a thin trunk and a crown above it, the rest their boxes.
std::vector<Solid> solidsOf(const Prop& prop);

}  // namespace perdure::sim
