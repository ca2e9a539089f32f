// Streets or rooms with objects anywhere, and a camera that changes its place every second.
#include <cmath>

#include "common/sim/scenes/parts/rigs.h"
#include "common/sim/scenes/parts/rooms.h"
#include "common/sim/scenes/parts/streets.h"
#include "common/sim/scenes/parts/views.h"
#include "common/sim/scenes/scenes.h"

namespace perdure::sim {
namespace {

constexpr double kRandomSeconds = 40.0;

/// Two crossing streets with their usual objects, and further objects at unusual places.
Area makeOutdoors(SceneBuilder& builder) {
  Dice& dice = builder.dice();
  const double length = dice.uniform(35.0, 55.0), width = dice.uniform(8.0, 12.0);
  const double turn = dice.uniform(0.0, M_PI);
  const Eigen::Vector2d way(std::cos(turn), std::sin(turn)), across(-way.y(), way.x());
  const Eigen::Vector2d crossing = dice.uniform(-0.5, 0.5) * length * way;
  Furnishing furnishing;
  furnishing.mean_gap = dice.uniform(0.8, 4.0);
  furnishing.free_share = dice.uniform(0.2, 0.5);
  furnishing.van_share = dice.uniform(0.2, 0.6);
  furnishing.reversed_share = 0.4;
  furnishing.pavement = dice.uniform(2.6, 5.0);
  furnishing.person_every = dice.uniform(6.0, 14.0);
  furnishing.bicycle_every = dice.uniform(6.0, 14.0);
  furnishing.hedge_share = dice.uniform(0.0, 0.6);
  Streets streets(builder,
                  {{-length * way, length * way, width},
                   {crossing - 30.0 * across, crossing + 30.0 * across, width}},
                  furnishing);
  streets.furnish();
  const auto anywhere = [&] {
    const double along = dice.uniform(-0.9, 0.9) * length;
    return Eigen::Vector2d(along * way + dice.uniform(-0.7, 0.7) * width * across);
  };
  for (const char* name : {"car", "van", "person", "bicycle"}) {
    for (int i = 0; i < 5; ++i) {
      builder.put(builder.draw(name), {anywhere(), dice.uniform(-M_PI, M_PI), 0.0}, 0.2);
    }
  }
  for (const char* name : {"chair", "dining table", "couch"}) {
    if (dice.chance(0.3))
      builder.put(builder.draw(name), {anywhere(), dice.uniform(-M_PI, M_PI), 0.0}, 0.2);
  }
  for (int i = 0; i < 4; ++i) {
    const Eigen::Vector3d size(dice.uniform(0.3, 1.2), dice.uniform(0.3, 0.9),
                               dice.uniform(0.3, 1.4));
    builder.put(PropKind::kCrate, size, {anywhere(), dice.uniform(-M_PI, M_PI), 0.0}, 0.2);
  }
  drawDaylight(builder);
  const double reach = length + 5.0;
  return {{-reach, -reach}, {reach, reach}};
}

Area makeIndoors(SceneBuilder& builder) {
  Dice& dice = builder.dice();
  Room room(builder, dice.uniform(7.0, 14.0), dice.uniform(6.0, 10.0));
  const int tables = 1 + static_cast<int>(dice.below(3));
  for (int i = 0; i < tables; ++i) {
    const Eigen::Vector2d point(dice.uniform(-0.3, 0.3) * room.length(),
                                dice.uniform(-0.3, 0.3) * room.width());
    room.putTable(point, dice.uniform(-M_PI, M_PI), static_cast<int>(dice.below(6)),
                  static_cast<int>(dice.below(3)));
  }
  room.furnishWalls();
  room.scatter("chair", 2);
  room.scatter("couch", 1);
  room.scatter("person", 1 + static_cast<int>(dice.below(3)));
  if (dice.chance(0.3)) room.scatter("bicycle", 1);
  room.scatterCrates(2);
  const Eigen::Vector2d half(0.5 * room.length() - 0.3, 0.5 * room.width() - 0.3);
  return {-half, half};
}

}  // namespace

Scene makeRandom(std::uint64_t seed, const SceneOptions& options) {
  SceneBuilder builder("random", seed, options);
  Dice& dice = builder.dice();
  builder.scene().seconds = builder.seconds(kRandomSeconds);
  builder.scene().rig = makeRig(Carrier::kHand, options, dice, 0.0);
  const bool outdoors = seed % 2 == 0;
  const Area area = outdoors ? makeOutdoors(builder) : makeIndoors(builder);
  ViewFinder finder(builder, area, outdoors ? 7.0 : 0.8);
  std::vector<View> views;
  for (double t = 0.0; t <= builder.scene().seconds; t += 1.0) views.push_back(finder.draw());
  builder.scene().body = throughViews(views);
  return builder.take();
}

}  // namespace perdure::sim
