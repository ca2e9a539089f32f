// Puts a scene together: gives ids and looks, and refuses what would stand in something else, in a
// road's way or in the body's path.
#pragma once

#include <string>
#include <vector>

#include "common/sim/catalogue.h"
#include "common/sim/scene.h"
#include "common/sim/solid.h"

namespace perdure::sim {

/// Where a thing is put: its place on the ground, its yaw and the height of its underside.
struct Place {
  Eigen::Vector2d point = Eigen::Vector2d::Zero();
  double yaw = 0.0, low = 0.0;
};
/// Of the centre of a thing of this height.
RigidTransform poseOf(const Place& place, double height);
Solid solidAt(const Place& place, const Eigen::Vector3d& size);

class SceneBuilder {
 public:
  SceneBuilder(const std::string& name, std::uint64_t seed, const SceneOptions& options);

  Scene& scene() { return scene_; }
  Dice& dice() { return dice_; }
  const SceneOptions& options() const { return options_; }
  double seconds(double by_default) const { return options_.seconds.value_or(by_default); }

  /// The body's motion; nothing that reaches under `height` is put within `clearance` of its path.
  void setBody(Trajectory motion, double seconds, double clearance, double height);
  /// Nothing is put there from now on.
  void reserve(const Solid& solid) { reserved_.push_back(solid); }
  /// Where a thing that moves goes while it is watched: nothing is put in its way.
  void reserveWay(const SceneObject& object, double until_s, double margin);

  SceneObject draw(const std::string& class_name) {
    return drawObject(class_name, dice_, options_.look_set);
  }
  std::uint64_t look() { return lookSeed(dice_, options_.look_set); }

  /// False, and nothing happens, where it would meet anything by less than `margin`.
  bool put(SceneObject object, const Place& place, double margin = 0.05);
  bool put(PropKind kind, const Eigen::Vector3d& size, const Place& place, double margin = 0.02);
  /// As `put`, for what a scene cannot do without. The last object's reference is handed back.
  SceneObject& mustPut(SceneObject object, const Place& place);
  void mustPut(PropKind kind, const Eigen::Vector3d& size, const Place& place);
  /// A thing with a motion of its own, checked by the caller (see reserveWay).
  SceneObject& putMoving(SceneObject object, Trajectory motion);

  bool isFree(const Solid& solid, double margin) const;
  Scene take() { return std::move(scene_); }

 private:
  bool inBodysWay(const Solid& solid) const;

  SceneOptions options_;
  Scene scene_;
  Dice dice_;
  std::vector<Solid> solids_, reserved_;
  std::vector<Eigen::Vector2d> way_;
  double clearance_ = 0.0, body_height_ = 0.0;
  std::uint64_t next_id_ = 1;
};

}  // namespace perdure::sim
