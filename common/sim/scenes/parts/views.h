// Views for training: camera poses in which an object has a desired size in the image.
#pragma once

#include <optional>
#include <vector>

#include "common/sim/scenes/parts/builder.h"

namespace perdure::sim {

/// The ground area for cameras.
struct Area {
  Eigen::Vector2d low, high;
};

/// The pose and velocity of the body at a view.
struct View {
  RigidTransform T_WB;
  Eigen::Vector3d velocity_W = Eigen::Vector3d::Zero(), turn_rate_B = Eigen::Vector3d::Zero();
};

class ViewFinder {
 public:
  ViewFinder(SceneBuilder& builder, const Area& area, double top_speed);

  /// A view of an object. Its class is drawn uniformly from the classes in the scene.
  View draw();

 private:
  std::optional<View> lookAt(const SceneObject& object);
  std::optional<Eigen::Vector2d> standAt(const SceneObject& object, double distance, double height);
  bool sees(const Eigen::Vector3d& eye, const SceneObject& object) const;
  View viewFrom(const Eigen::Vector3d& eye, double yaw, double pitch_down);

  SceneBuilder& builder_;
  Area area_;
  double top_speed_;
  std::vector<Solid> scenery_;  ///< possible occluders
  std::vector<std::pair<std::string, std::vector<std::size_t>>> by_class_;
};

/// Returns a trajectory that passes one view a second, each with its own velocity. The motion
/// between views is arbitrary.
Trajectory throughViews(const std::vector<View>& views);

}  // namespace perdure::sim
