// A walk around a table in a furnished room.
#include <limits>

#include "common/sim/scenes/parts/rigs.h"
#include "common/sim/scenes/parts/rooms.h"
#include "common/sim/scenes/scenes.h"

namespace perdure::sim {
namespace {

constexpr double kRoomSeconds = 45.0, kRoomCameraHeight = 1.5;

}  // namespace

Scene makeRoom(std::uint64_t seed, const SceneOptions& options) {
  SceneBuilder builder("room", seed, options);
  Dice& dice = builder.dice();
  Room room(builder, dice.uniform(9.4, 10.4), dice.uniform(7.6, 8.4));
  const double x = 2.5 + dice.uniform(-0.1, 0.1), y = 1.85 + dice.uniform(-0.1, 0.1);
  const GroundPath way({{{-x, -y}, 1.0}, {{x, -y}, 1.0}, {{x, y}, 1.0}, {{-x, y}, 1.0}}, true, 1.0);
  const double seconds = builder.seconds(kRoomSeconds);
  const SpeedLimits limits{dice.uniform(0.75, 0.9), 0.6, 0.5, 0.5};
  const Drive walk = drive(way, limits, dice.uniform(0.0, way.length()),
                           std::numeric_limits<double>::infinity(), 1.2, seconds + 2.0);
  builder.setBody(handheldMotion(way, walk, kRoomCameraHeight - kCameraAboveBody), seconds, 0.42,
                  2.0);
  builder.scene().rig = makeRig(Carrier::kHand, options, dice, 0.0);
  room.putTable({dice.uniform(-0.2, 0.2), dice.uniform(-0.1, 0.1)},
                0.5 * M_PI + dice.uniform(-0.1, 0.1), 4, 2);
  room.furnishWalls();
  return builder.take();
}

}  // namespace perdure::sim
