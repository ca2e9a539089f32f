// A near toy car that is as large in the image as a real car at a distance. A sideways motion
// reveals its size; without motion, its size stays unknown.
#include <cmath>

#include "common/sim/scenes/parts/rigs.h"
#include "common/sim/scenes/parts/rooms.h"
#include "common/sim/scenes/parts/streets.h"
#include "common/sim/scenes/scenes.h"

namespace perdure::sim {
namespace {

constexpr double kToySeconds = 24.0, kStillSeconds = 20.0, kToyCameraHeight = 1.35;
constexpr double kScale = 14.0;        ///< the toy is a 4.2 m car, scaled to 0.3 m
constexpr double kToyDistance = 1.35;  ///< distance from the start of the camera
constexpr double kToyInterval = 0.05;

/// Point in the body frame at this distance and bearing from the camera's start.
Eigen::Vector2d polar(double distance, double bearing) {
  return distance * Eigen::Vector2d(std::cos(bearing), std::sin(bearing)) +
         Eigen::Vector2d(kCameraBeforeBody, 0.0);
}

SceneObject carOf(SceneBuilder& builder, double length) {
  SceneObject car = builder.draw("car");
  car.shape = "hatchback";
  car.size = length / 4.2 * Eigen::Vector3d(4.2, 1.75, 1.47);
  return car;
}

void putCars(SceneBuilder& builder) {
  Dice& dice = builder.dice();
  const double yaw = dice.uniform(0.5, 1.0), far_bearing = 0.2, near_bearing = -0.3;
  const SceneObject car = carOf(builder, 4.2);
  builder.mustPut(car, {polar(kScale * kToyDistance, far_bearing), far_bearing + yaw, 0.0});
  builder.mustPut(carOf(builder, 4.2), {polar(29.0, -0.13), dice.uniform(-1.0, 1.0), 0.0});
  builder.mustPut(carOf(builder, 4.2), {polar(40.0, 0.02), dice.uniform(-1.0, 1.0), 0.0});
  // Its image is the same, because size and distance are both fourteen times smaller.
  SceneObject toy = builder.draw("toy");
  toy.shape = "hatchback";
  toy.size = car.size / kScale;
  const double centre = kToyCameraHeight - (kToyCameraHeight - 0.5 * car.size.z()) / kScale;
  const double top = centre - 0.5 * toy.size.z();
  const Eigen::Vector2d point = polar(kToyDistance, near_bearing);
  builder.mustPut(PropKind::kCrate, {0.31, 0.31, top}, {point, near_bearing, 0.0});
  builder.mustPut(std::move(toy), {point, near_bearing + yaw, top});
}

/// Motion back and forth across the viewing direction, with a small part along it.
Trajectory sideways(double seconds) {
  std::vector<Look> looks;
  for (double t = 0.0; t < seconds + 2.0; t += kToyInterval) {
    const double since = std::max(0.0, t - 1.2), begun = std::min(1.0, since / 2.0);
    const double grown = begun * begun * (3.0 - 2.0 * begun);
    const double phase = 2.0 * M_PI * since / 5.0;
    const double y = grown * (0.18 + 0.3 * std::sin(phase));
    looks.push_back({{0.2 * grown * std::sin(0.5 * phase), y},
                     -0.05 - 0.25 * y + 0.03 * grown * std::sin(0.7 * phase),
                     0.02 + 0.04 * grown * std::sin(1.3 * phase),
                     0.04 * grown * std::sin(0.9 * phase)});
  }
  return handheldMotion(looks, kToyInterval, kToyCameraHeight - kCameraAboveBody);
}

Scene makePlace(SceneBuilder& builder, Trajectory body, double seconds) {
  builder.setBody(std::move(body), seconds, 0.4, 2.0);
  builder.scene().rig = makeRig(Carrier::kHand, builder.options(), builder.dice(), 0.0);
  drawDaylight(builder);
  putCars(builder);
  Furnishing furnishing;
  furnishing.free_share = 1.0;  // no other cars
  furnishing.person_every = furnishing.bicycle_every = 1e9;
  furnishing.hedge_share = 0.0;
  Streets(builder, {{{-15.0, 0.0}, {70.0, 0.0}, 16.0}}, furnishing).furnish();
  return builder.take();
}

}  // namespace

Scene makeToy(std::uint64_t seed, const SceneOptions& options) {
  SceneBuilder builder("toy", seed, options);
  const double seconds = builder.seconds(kToySeconds);
  return makePlace(builder, sideways(seconds), seconds);
}

Scene makeStill(std::uint64_t seed, const SceneOptions& options) {
  SceneBuilder builder("still", seed, options);
  const Eigen::Vector3d place(0.0, 0.0, kToyCameraHeight - kCameraAboveBody);
  return makePlace(
      builder,
      Trajectory(RigidTransform(
          Eigen::Quaterniond(Eigen::AngleAxisd(-0.05, Eigen::Vector3d::UnitZ())), place)),
      builder.seconds(kStillSeconds));
}

}  // namespace perdure::sim
