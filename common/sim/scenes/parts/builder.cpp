#include "common/sim/scenes/parts/builder.h"

#include <algorithm>

#include "common/base/check.h"
#include "common/math/so3.h"

namespace perdure::sim {
RigidTransform poseOf(const Place& place, double height) {
  return RigidTransform(
      expQuaternion({0, 0, place.yaw}),
      Eigen::Vector3d(place.point.x(), place.point.y(), place.low + 0.5 * height));
}

Solid solidAt(const Place& place, const Eigen::Vector3d& size) {
  return {place.point, place.yaw, 0.5 * size.head<2>(), place.low, place.low + size.z()};
}

SceneBuilder::SceneBuilder(const std::string& name, std::uint64_t seed, const SceneOptions& options)
    : options_(options), dice_(seedOf(name, {seed, seedOf(options.look_set, {})})) {
  scene_.name = name;
  scene_.seed = seed;
}

void SceneBuilder::setBody(Trajectory motion, double seconds, double clearance, double height) {
  scene_.body = std::move(motion);
  scene_.seconds = seconds;
  clearance_ = clearance;
  body_height_ = height;
  way_.clear();
  for (double t = -1.0; t <= seconds + 1.0; t += 0.02) {
    const Eigen::Vector2d p = scene_.body.poseAt(t).p.head<2>();
    if (way_.empty() || (p - way_.back()).norm() > 0.3) way_.push_back(p);
  }
}

void SceneBuilder::reserveWay(const SceneObject& object, double until_s, double margin) {
  Eigen::Vector2d last(1e9, 1e9);
  for (double t = -1.0; t <= until_s + 1.0; t += 0.05) {
    Solid solid = solidOf(object, t);
    if ((solid.centre - last).norm() < 0.5) continue;
    last = solid.centre;
    solid.half.array() += margin;
    reserved_.push_back(solid);
  }
}

bool SceneBuilder::inBodysWay(const Solid& solid) const {
  if (solid.low > body_height_) return false;
  const double far = solid.half.norm() + clearance_;
  return std::ranges::any_of(way_, [&](const Eigen::Vector2d& point) {
    return (point - solid.centre).squaredNorm() < far * far &&
           distanceTo(solid, point) < clearance_;
  });
}

bool SceneBuilder::isFree(const Solid& solid, double margin) const {
  const auto meets = [&](const Solid& other) {
    // An object on a support touches the support, so that the margin applies horizontally only.
    const bool apart_in_height = std::max(other.low - solid.high, solid.low - other.high) > -1e-6;
    return !apart_in_height && meet(solid, other, margin);
  };
  return std::ranges::none_of(solids_, meets) && std::ranges::none_of(reserved_, meets) &&
         !inBodysWay(solid);
}

bool SceneBuilder::put(SceneObject object, const Place& place, double margin) {
  object.motion = Trajectory(poseOf(place, object.size.z()));
  const Solid solid = solidOf(object, 0.0);
  if (!isFree(solid, margin)) return false;
  object.id = next_id_++;
  solids_.push_back(solid);
  scene_.objects.push_back(std::move(object));
  return true;
}

bool SceneBuilder::put(PropKind kind, const Eigen::Vector3d& size, const Place& place,
                       double margin) {
  Prop prop{kind, look(), size, poseOf(place, size.z())};
  const std::vector<Solid> solids = solidsOf(prop);
  for (const Solid& solid : solids) {
    if (!isFree(solid, margin)) return false;
  }
  solids_.insert(solids_.end(), solids.begin(), solids.end());
  scene_.props.push_back(std::move(prop));
  return true;
}

SceneObject& SceneBuilder::mustPut(SceneObject object, const Place& place) {
  check(put(std::move(object), place, -1e-6), "there is room for what the scene is about");
  return scene_.objects.back();
}

void SceneBuilder::mustPut(PropKind kind, const Eigen::Vector3d& size, const Place& place) {
  check(put(kind, size, place, -1e-6), "there is room for what the scene is about");
}

SceneObject& SceneBuilder::putMoving(SceneObject object, Trajectory motion) {
  object.motion = std::move(motion);
  object.moves = true;
  object.id = next_id_++;
  scene_.objects.push_back(std::move(object));
  return scene_.objects.back();
}

}  // namespace perdure::sim
