// Ten cars parked in a row, 0.8 m apart.

#include "common/sim/path.h"
#include "common/sim/scenes/parts/rigs.h"
#include "common/sim/scenes/parts/streets.h"
#include "common/sim/scenes/scenes.h"

namespace perdure::sim {
namespace {

constexpr double kRowSeconds = 24.0, kGap = 0.8, kFirst = 24.0;
constexpr int kCars = 10;

void parkRow(SceneBuilder& builder) {
  Dice& dice = builder.dice();
  const double side = dice.chance(0.5) ? 1.0 : -1.0;
  double along = kFirst;
  for (int i = 0; i < kCars; ++i) {
    SceneObject car = builder.draw("car");
    const double length = car.size.x();
    const double across = 0.5 * kRoadWidth - 0.18 - 0.5 * car.size.y();
    builder.mustPut(std::move(car),
                    {{along + 0.5 * length, side * across}, side > 0 ? M_PI : 0.0, 0.0});
    along += length + kGap;
  }
}

}  // namespace

Scene makeRow(std::uint64_t seed, const SceneOptions& options) {
  SceneBuilder builder("row", seed, options);
  const double seconds = builder.seconds(kRowSeconds);
  const GroundPath way({{{0, -kLane}}, {{150, -kLane}}}, false);
  const SpeedLimits limits{4.5, 2.0, 1.2, 1.2};
  // The drive stops beyond the row, whatever the duration of the scene.
  const Drive driven = drive(way, limits, 0.0, 95.0, 1.2, seconds + 2.0);
  putOnWheels(builder, way, driven, seconds, options);
  parkRow(builder);
  Furnishing furnishing;
  furnishing.free_share = 1.0;  // no other parked vehicles
  Streets(builder, {{{-20.0, 0.0}, {130.0, 0.0}, kRoadWidth}}, furnishing).furnish();
  return builder.take();
}

}  // namespace perdure::sim
