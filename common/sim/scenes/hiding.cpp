// Rooms in which an object is temporarily occluded or outside the field of view.
#include <algorithm>
#include <cmath>

#include "common/math/so3.h"
#include "common/sim/scenes/parts/rigs.h"
#include "common/sim/scenes/parts/rooms.h"
#include "common/sim/scenes/scenes.h"

namespace perdure::sim {
namespace {

constexpr double kHidingInterval = 0.05;

/// A value at a time; values between keys are interpolated smoothly.
struct Key {
  double t_s, value;
};

double smoothly(const std::vector<Key>& keys, double t_s) {
  std::size_t i = 0;
  while (i + 1 < keys.size() && keys[i + 1].t_s <= t_s) ++i;
  if (i + 1 == keys.size() || t_s < keys.front().t_s) return keys[i].value;
  const double s = (t_s - keys[i].t_s) / (keys[i + 1].t_s - keys[i].t_s);
  // Quintic interpolation: velocity and acceleration are zero at each key.
  return keys[i].value +
         s * s * s * (10.0 + s * (6.0 * s - 15.0)) * (keys[i + 1].value - keys[i].value);
}

RigidTransform standing(const SceneObject& object, const Eigen::Vector2d& point, double yaw) {
  return RigidTransform(expQuaternion({0, 0, yaw}),
                        Eigen::Vector3d(point.x(), point.y(), 0.5 * object.size.z()));
}

// ---- occlusion: the camera moves sideways and back; the monitor hides the chair.

constexpr double kOcclusionSeconds = 32.0, kOcclusionHeight = 1.45, kWalkX = -3.2;

Trajectory walkPast(double seconds) {
  const std::vector<Key> across{{1.2, 1.7},   {4.0, 1.4},   {6.5, 1.8},  {9.8, 0.0},  {13.5, 0.0},
                                {16.8, -1.8}, {20.0, -1.5}, {23.3, 0.0}, {26.0, 0.0}, {29.4, 1.8}};
  std::vector<Look> looks;
  for (double t = 0.0; t < seconds + 2.0; t += kHidingInterval) {
    const double y = smoothly(across, t);
    const double since = std::max(0.0, t - 1.2), begun = std::min(1.0, since / 2.0);
    const double yaw = std::atan2(-y, 3.0) + 0.06 * begun * std::sin(0.9 * since);
    looks.push_back({{kWalkX + 0.05 * begun * std::sin(1.1 * since), y},
                     yaw,
                     0.18 + 0.04 * begun * std::sin(1.7 * since),
                     0.03 * begun * std::sin(since)});
  }
  return handheldMotion(looks, kHidingInterval, kOcclusionHeight - kCameraAboveBody);
}

void putHiddenChair(SceneBuilder& builder) {
  SceneObject table = builder.draw("dining table");
  table.size = {0.9, 1.0, 0.74};
  SceneObject monitor = builder.draw("monitor");
  monitor.size = {0.2, 0.68, 0.5};
  SceneObject chair = builder.draw("chair");
  chair.size = {0.5, 0.48, 0.82};
  // All objects are in line with the camera's middle position; the screen faces the camera.
  builder.mustPut(table, {{kWalkX + 1.95, 0.0}, M_PI, 0.0});
  builder.mustPut(std::move(monitor), {{kWalkX + 1.9, 0.0}, M_PI, table.size.z()});
  builder.mustPut(std::move(chair), {{kWalkX + 4.2, 0.0}, builder.dice().uniform(2.7, 3.5), 0.0});
}

// ---- vanish: the camera faces the objects, turns away, and turns back.

constexpr double kVanishSeconds = 28.0, kVanishHeight = 1.5, kGoneAt = 12.0, kMovedAt = 12.4;

Trajectory lookTwice(double seconds) {
  const std::vector<Key> turn{{7.0, 0.0}, {11.0, M_PI}, {14.6, M_PI}, {18.6, 2.0 * M_PI}};
  const std::vector<Key> across{{1.2, 0.0},  {3.0, 0.8},   {5.5, -0.8}, {8.0, 0.0},  {11.0, 0.5},
                                {14.0, 0.0}, {19.0, -0.8}, {22.0, 0.8}, {25.0, -0.3}};
  std::vector<Look> looks;
  for (double t = 0.0; t < seconds + 2.0; t += kHidingInterval) {
    const double since = std::max(0.0, t - 1.2), begun = std::min(1.0, since / 2.0);
    looks.push_back({{-2.4 + 0.15 * begun * std::sin(0.8 * since), smoothly(across, t)},
                     smoothly(turn, t) + 0.08 * begun * std::sin(since),
                     0.15 + 0.04 * begun * std::sin(1.7 * since),
                     0.03 * begun * std::sin(since)});
  }
  return handheldMotion(looks, kHidingInterval, kVanishHeight - kCameraAboveBody);
}

void putThingsThatChange(SceneBuilder& builder) {
  Dice& dice = builder.dice();
  builder.mustPut(builder.draw("chair"), {{0.6, 1.3}, dice.uniform(2.5, 3.8), 0.0})
      .present_until_s = kGoneAt;
  SceneObject& moved =
      builder.mustPut(builder.draw("chair"), {{0.4, -0.6}, dice.uniform(2.5, 3.8), 0.0});
  const RigidTransform before = moved.motion.poseAt(0.0);
  const RigidTransform after = standing(moved, {1.3, -1.7}, dice.uniform(-0.6, 0.6));
  moved.motion = Trajectory(kMovedAt, 1e-4, {before, after});
  moved.moves = moved.steps = true;
  builder.reserve(solidOf(moved, kMovedAt + 1.0));
  builder.mustPut(builder.draw("couch"), {{3.6, 0.4}, M_PI, 0.0});
}

Scene makeHiding(SceneBuilder& builder, double by_default, Trajectory (*motion)(double seconds),
                 void (*putThings)(SceneBuilder& builder)) {
  Room room(builder, 9.0, 7.0);
  const double seconds = builder.seconds(by_default);
  builder.setBody(motion(seconds), seconds, 0.42, 2.0);
  builder.scene().rig = makeRig(Carrier::kHand, builder.options(), builder.dice(), 0.0);
  putThings(builder);
  room.furnishWalls();
  return builder.take();
}

}  // namespace

Scene makeOcclusion(std::uint64_t seed, const SceneOptions& options) {
  SceneBuilder builder("occlusion", seed, options);
  return makeHiding(builder, kOcclusionSeconds, walkPast, putHiddenChair);
}

Scene makeVanish(std::uint64_t seed, const SceneOptions& options) {
  SceneBuilder builder("vanish", seed, options);
  return makeHiding(builder, kVanishSeconds, lookTwice, putThingsThatChange);
}

}  // namespace perdure::sim
