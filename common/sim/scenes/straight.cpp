// A drive along a long street, at constant speed after a start from rest.
#include <algorithm>
#include <limits>

#include "common/sim/path.h"
#include "common/sim/scenes/parts/rigs.h"
#include "common/sim/scenes/parts/streets.h"
#include "common/sim/scenes/scenes.h"

namespace perdure::sim {
namespace {

constexpr double kStraightSeconds = 60.0, kStraightSpeed = 8.5, kStraightRest = 1.2;

}  // namespace

Scene makeStraight(std::uint64_t seed, const SceneOptions& options) {
  SceneBuilder builder("straight", seed, options);
  Dice& dice = builder.dice();
  const double seconds = builder.seconds(kStraightSeconds);
  const double end = kStraightSpeed * std::max(seconds, kStraightSeconds) + 70.0;
  const GroundPath way({{{0, -kLane}}, {{end, -kLane}}}, false);
  const SpeedLimits limits{kStraightSpeed, 2.0, 1.4, 1.4};
  const Drive driven = drive(way, limits, 0.0, std::numeric_limits<double>::infinity(),
                             kStraightRest, seconds + 2.0);
  putOnWheels(builder, way, driven, seconds, options);
  std::vector<Road> roads{{{-25.0, 0.0}, {end, 0.0}, kRoadWidth}};
  for (double x = dice.uniform(60.0, 90.0); x < end - 50.0; x += dice.uniform(90.0, 140.0)) {
    roads.push_back({{x, -35.0}, {x, 35.0}, kRoadWidth});
  }
  Streets(builder, roads, Furnishing{}).furnish();
  return builder.take();
}

}  // namespace perdure::sim
