// A loop of four streets around a block, driven twice, or once from rest to rest.
#include <algorithm>
#include <limits>

#include "common/sim/path.h"
#include "common/sim/scenes/parts/rigs.h"
#include "common/sim/scenes/parts/streets.h"
#include "common/sim/scenes/scenes.h"

namespace perdure::sim {
namespace {

constexpr double kStreetSeconds = 60.0, kStreetRest = 1.2, kSideStreet = 38.0;
constexpr double kLapSeconds = 36.0;
constexpr double kStreetCameraHeight = 1.6;

/// A block between the crossings (0, 0), (length, 0), (length, width) and (0, width) of centre
/// lines.
struct Block {
  double length = 0.0, width = 0.0;
};

std::vector<Road> roadsOf(const Block& block, double branch) {
  const double l = block.length, w = block.width, s = kSideStreet;
  return {{{-s, 0}, {l + s, 0}, kRoadWidth},
          {{l, -s}, {l, w + s}, kRoadWidth},
          {{l + s, w}, {-s, w}, kRoadWidth},
          {{0, w + s}, {0, -s}, kRoadWidth},
          // One more side street branches off at the middle of a long side.
          {{branch, w + 0.5 * kRoadWidth}, {branch, w + s}, kRoadWidth}};
}

/// The path around the block on the right-hand lane, counter-clockwise.
GroundPath loopOf(const Block& block, double radius) {
  const double l = block.length + kLane, w = block.width + kLane;
  return GroundPath(
      {{{-kLane, -kLane}, radius}, {{l, -kLane}, radius}, {{l, w}, radius}, {{-kLane, w}, radius}},
      true);
}

/// The slowest drive to distance `to` (infinite: without end) that covers the distance `far` by
/// time `by_s`.
Drive calmest(const GroundPath& loop, double from, double to, double far, double by_s,
              double until_s) {
  SpeedLimits limits;
  limits.lateral = 2.5;
  double slow = 6.0, fast = 10.0;
  Drive best;
  for (int i = 0; i < 12; ++i) {
    limits.top = 0.5 * (slow + fast);
    best = drive(loop, limits, from, to, kStreetRest, until_s);
    const bool enough = best.distanceAt(by_s) - from >= far;
    (enough ? fast : slow) = limits.top;
  }
  return best;
}

Drive twoLaps(const GroundPath& loop, double from, double until_s) {
  return calmest(loop, from, std::numeric_limits<double>::infinity(), 2.0 * loop.length(),
                 kStreetSeconds - 1.0, until_s);
}

/// Drives one lap. drive() stops within one step of the end; the lap is scaled to end exactly
/// there.
Drive oneLap(const GroundPath& loop, double from, double until_s) {
  Drive lap = calmest(loop, from, from + loop.length(), loop.length() - 1e-6,
                      kLapSeconds - 2.0 * kStreetRest, until_s);
  const double share = loop.length() / (lap.distance.back() - from);
  for (double& s : lap.distance) s = from + share * (s - from);
  return lap;
}

using DrivesAs = Drive (*)(const GroundPath& loop, double from, double until_s);

Scene makeBlock(SceneBuilder& builder, double seconds, DrivesAs drives, bool same_road) {
  Dice& dice = builder.dice();
  const Block block{dice.uniform(62.0, 66.0), dice.uniform(42.0, 44.5)};
  const GroundPath loop = loopOf(block, 16.0);
  Suspension suspension;
  suspension.height = kStreetCameraHeight - kCameraAboveBody;
  suspension.seed = dice.seed();
  if (same_road) suspension.lap_m = loop.length();
  const double from = dice.uniform(27.0, 33.0);  // the start is on the first straight
  builder.setBody(
      vehicleMotion(loop, drives(loop, from, std::max(seconds, kStreetSeconds) + 2.0), suspension),
      seconds, 1.15, 2.2);
  builder.scene().rig = makeRig(Carrier::kVehicle, builder.options(), dice, 0.02);
  drawDaylight(builder);
  Streets streets(builder, roadsOf(block, dice.uniform(0.4, 0.6) * block.length), Furnishing{});
  streets.furnish();
  return builder.take();
}

}  // namespace

Scene makeStreet(std::uint64_t seed, const SceneOptions& options) {
  SceneBuilder builder("street", seed, options);
  return makeBlock(builder, builder.seconds(kStreetSeconds), twoLaps, false);
}

Scene makeLap(std::uint64_t seed, const SceneOptions& options) {
  SceneBuilder builder("lap", seed, options);
  return makeBlock(builder, builder.seconds(kLapSeconds), oneLap, true);
}

}  // namespace perdure::sim
