// Views for training: where a camera could stand to see a thing as large as wanted.
#pragma once

#include <optional>
#include <vector>

#include "common/sim/scenes/parts/builder.h"

namespace perdure::sim {

/// The ground on which cameras may stand.
struct Area {
  Eigen::Vector2d low, high;
};

/// A body's pose at a view and how it moves through it.
struct View {
  RigidTransform T_WB;
  Eigen::Vector3d velocity_W = Eigen::Vector3d::Zero(), turn_rate_B = Eigen::Vector3d::Zero();
};

class ViewFinder {
 public:
  ViewFinder(SceneBuilder& builder, const Area& area, double top_speed);

  /// A view on a thing of a class drawn evenly from those that are there.
  View draw();

 private:
  std::optional<View> lookAt(const SceneObject& object);
  std::optional<Eigen::Vector2d> standAt(const SceneObject& object, double distance, double height);
  bool sees(const Eigen::Vector3d& eye, const SceneObject& object) const;
  View viewFrom(const Eigen::Vector3d& eye, double yaw, double pitch_down);

  SceneBuilder& builder_;
  Area area_;
  double top_speed_;
  std::vector<Solid> scenery_;  ///< what hides
  std::vector<std::pair<std::string, std::vector<std::size_t>>> by_class_;
};

/// Views one second apart, each passed through at its own velocity; in between it is elsewhere.
Trajectory throughViews(const std::vector<View>& views);

}  // namespace perdure::sim
