// Builds a scene: assigns ids and looks, and refuses objects that would intersect others or block a
// road or the body's path.
#pragma once

#include <string>
#include <vector>

#include "common/sim/catalogue.h"
#include "common/sim/scene.h"
#include "common/sim/solid.h"

namespace perdure::sim {

/// The placement of an object: its position on the ground, yaw, and height of its underside.
struct Place {
  Eigen::Vector2d point = Eigen::Vector2d::Zero();
  double yaw = 0.0, low = 0.0;
};
RigidTransform poseOf(const Place& place, double height);
Solid solidAt(const Place& place, const Eigen::Vector3d& size);

class SceneBuilder {
 public:
  SceneBuilder(const std::string& name, std::uint64_t seed, const SceneOptions& options);

  Scene& scene() { return scene_; }
  Dice& dice() { return dice_; }
  const SceneOptions& options() const { return options_; }
  double seconds(double by_default) const { return options_.seconds.value_or(by_default); }

  /// Sets the body's motion. Objects with an underside below `height` are not placed within
  /// `clearance` of its path.
  void setBody(Trajectory motion, double seconds, double clearance, double height);
  void reserve(const Solid& solid) { reserved_.push_back(solid); }
  void reserveWay(const SceneObject& object, double until_s, double margin);

  SceneObject draw(const std::string& class_name) {
    return drawObject(class_name, dice_, options_.look_set);
  }
  std::uint64_t look() { return lookSeed(dice_, options_.look_set); }

  /// Adds an object. Returns false, without an effect, if its gap to any other is less than
  /// `margin`.
  bool put(SceneObject object, const Place& place, double margin = 0.05);
  bool put(PropKind kind, const Eigen::Vector3d& size, const Place& place, double margin = 0.02);
  /// Places an object as put() does, but aborts on failure. Returns the new object.
  SceneObject& mustPut(SceneObject object, const Place& place);
  void mustPut(PropKind kind, const Eigen::Vector3d& size, const Place& place);
  /// Adds an object with its own motion. The caller checks that it is free (see reserveWay).
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
