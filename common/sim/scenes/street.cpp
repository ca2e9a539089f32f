// A loop of four streets around a block, driven twice; side streets lead away from its corners.
#include <algorithm>
#include <limits>

#include "common/sim/path.h"
#include "common/sim/scenes/rigs.h"
#include "common/sim/scenes/scenes.h"
#include "common/sim/scenes/streets.h"

namespace perdure::sim {
namespace {

constexpr double kStreetSeconds = 60.0, kStreetRest = 1.2, kSideStreet = 38.0;
constexpr double kStreetCameraHeight = 1.6;

/// Crossings of the middle lines at (0, 0), (length, 0), (length, width), (0, width).
struct Block {
  double length = 0.0, width = 0.0;
};

std::vector<Road> roadsOf(const Block& block, double branch) {
  const double l = block.length, w = block.width, s = kSideStreet;
  return {{{-s, 0}, {l + s, 0}, kRoadWidth},
          {{l, -s}, {l, w + s}, kRoadWidth},
          {{l + s, w}, {-s, w}, kRoadWidth},
          {{0, w + s}, {0, -s}, kRoadWidth},
          // One more leads away from the middle of a long side.
          {{branch, w + 0.5 * kRoadWidth}, {branch, w + s}, kRoadWidth}};
}

/// Counter-clockwise on the right-hand lane: outside the middle lines.
GroundPath loopOf(const Block& block, double radius) {
  const double l = block.length + kLane, w = block.width + kLane;
  return GroundPath(
      {{{-kLane, -kLane}, radius}, {{l, -kLane}, radius}, {{l, w}, radius}, {{-kLane, w}, radius}},
      true);
}

/// The calmest drive that has gone round twice at the end.
Drive twoLaps(const GroundPath& loop, double from, double until_s) {
  SpeedLimits limits;
  limits.lateral = 2.5;
  double slow = 6.0, fast = 10.0;
  Drive best;
  for (int i = 0; i < 12; ++i) {
    limits.top = 0.5 * (slow + fast);
    best = drive(loop, limits, from, std::numeric_limits<double>::infinity(), kStreetRest, until_s);
    const bool enough = best.distanceAt(kStreetSeconds - 1.0) - from >= 2.0 * loop.length();
    (enough ? fast : slow) = limits.top;
  }
  return best;
}

}  // namespace

Scene makeStreet(std::uint64_t seed, const SceneOptions& options) {
  SceneBuilder builder("street", seed, options);
  Dice& dice = builder.dice();
  const Block block{dice.uniform(62.0, 66.0), dice.uniform(42.0, 44.5)};
  const GroundPath loop = loopOf(block, 16.0);
  const double seconds = builder.seconds(kStreetSeconds);
  Suspension suspension;
  suspension.height = kStreetCameraHeight - kCameraAboveBody;
  suspension.seed = dice.seed();
  const double from = dice.uniform(27.0, 33.0);  // on the first straight
  builder.setBody(
      vehicleMotion(loop, twoLaps(loop, from, std::max(seconds, kStreetSeconds) + 2.0), suspension),
      seconds, 1.15, 2.2);
  builder.scene().rig = makeRig(Carrier::kVehicle, options, dice, 0.02);
  drawDaylight(builder);
  Streets streets(builder, roadsOf(block, dice.uniform(0.4, 0.6) * block.length), Furnishing{});
  streets.furnish();
  return builder.take();
}

}  // namespace perdure::sim
