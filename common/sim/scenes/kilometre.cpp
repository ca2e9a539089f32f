// A rectangle of streets with a perimeter of one kilometre, driven twice at low speed.
#include <limits>

#include "common/sim/path.h"
#include "common/sim/scenes/parts/rigs.h"
#include "common/sim/scenes/parts/streets.h"
#include "common/sim/scenes/scenes.h"

namespace perdure::sim {
namespace {

constexpr double kKilometreSeconds = 620.0, kTopSpeed = 3.6;
constexpr int kAcross = 5, kAlong = 4;  // roads
constexpr double kTurnRadius = 9.0;

/// The path around all blocks on the right-hand lane, counter-clockwise.
GroundPath loopOfKilometre() {
  const double l = kGridX * (kAcross - 1) + kLane, w = kGridY * (kAlong - 1) + kLane;
  return GroundPath({{{-kLane, -kLane}, kTurnRadius},
                     {{l, -kLane}, kTurnRadius},
                     {{l, w}, kTurnRadius},
                     {{-kLane, w}, kTurnRadius}},
                    true);
}

}  // namespace

Scene makeKilometre(std::uint64_t seed, const SceneOptions& options) {
  SceneBuilder builder("kilometre", seed, options);
  const double seconds = builder.seconds(kKilometreSeconds);
  const GroundPath loop = loopOfKilometre();
  SpeedLimits limits;
  limits.top = kTopSpeed;
  const double from = builder.dice().uniform(30.0, 200.0);  // the start is on the first straight
  const Drive driven =
      drive(loop, limits, from, std::numeric_limits<double>::infinity(), 1.2, seconds + 2.0);
  putOnWheels(builder, loop, driven, seconds, options);
  Streets(builder, gridOfRoads(kAcross, kAlong), furnishingOfGrid()).furnish();
  return builder.take();
}

}  // namespace perdure::sim
