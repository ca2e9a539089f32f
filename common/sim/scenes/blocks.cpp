// A town of similar blocks, and a drive that passes many of them before it returns.
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "common/math/so3.h"
#include "common/sim/path.h"
#include "common/sim/scenes/parts/builder.h"
#include "common/sim/scenes/parts/streets.h"
#include "common/sim/scenes/scenes.h"

namespace perdure::sim {
namespace {

constexpr double kBlocksSeconds = 400.0;
constexpr double kPitchX = 52.0, kPitchY = 46.0;  ///< distance between roads
/// Number of crossings at which the drive may turn. A further row of blocks surrounds them.
constexpr int kCrossingsX = 7, kCrossingsY = 6;
constexpr std::size_t kBlocks = (kCrossingsX + 1) * (kCrossingsY + 1);
constexpr std::size_t kUnmistakable = 8, kWithFewChanges = 28;

constexpr double kPavementWidth = 3.25, kHouseDepth = 7.0;
constexpr double kNoParking = 3.5;  ///< distance from the crossing road's edge
constexpr double kShareParked = 0.68, kVanShare = 0.16, kReversedShare = 0.12;

/// A block of houses with the objects around it, relative to its centre. It is drawn once and
/// placed many times. Its kerbs are at ± `half`.
class Block {
 public:
  /// Draws houses, trees, poles, parked vehicles, bicycles and a person.
  Block(const Eigen::Vector2d& half, SceneBuilder& builder);

  /// Removes or adds objects (cars, bicycles or persons); `changes` is their number.
  void alter(std::size_t changes, SceneBuilder& builder);
  void putAt(const Eigen::Vector2d& middle, SceneBuilder& builder) const;

 private:
  struct Thing {
    SceneObject object;
    Place place;
  };
  struct Scenery {
    PropKind kind = PropKind::kFacade;
    Eigen::Vector3d size;
    Place place;
  };
  struct Side;

  static std::vector<Side> sidesOf(const Eigen::Vector2d& half);
  void build(const Side& side, double length, Dice& dice);
  void plant(const Side& side, Dice& dice);
  void park(const Side& side, SceneBuilder& builder);
  bool fits(const Solid& solid, double margin) const;
  bool add(SceneObject object, const Place& place, double margin);
  bool add(PropKind kind, const Eigen::Vector3d& size, const Place& place);
  bool addSomewhere(const std::string& class_name, SceneBuilder& builder);

  Eigen::Vector2d half_;
  std::vector<Thing> things_;
  std::vector<Scenery> scenery_;
};

struct Block::Side {
  Eigen::Vector2d outwards, along;  ///< along: the direction of the traffic on this side
  double from_middle = 0.0, half_length = 0.0;

  /// `outside`: distance from the kerb towards the road; negative on the pavement.
  Place at(double forward, double outside, double yaw) const {
    return {(from_middle + outside) * outwards + forward * along,
            wrapAngle(std::atan2(along.y(), along.x()) + yaw), 0.0};
  }
};

std::vector<Block::Side> Block::sidesOf(const Eigen::Vector2d& half) {
  return {{{0, -1}, {-1, 0}, half.y(), half.x()},
          {{1, 0}, {0, -1}, half.x(), half.y()},
          {{0, 1}, {1, 0}, half.y(), half.x()},
          {{-1, 0}, {0, 1}, half.x(), half.y()}};
}

Block::Block(const Eigen::Vector2d& half, SceneBuilder& builder) : half_(half) {
  for (const Side& side : sidesOf(half)) {
    // The houses of two sides fill the corners.
    const double corner = kPavementWidth + (side.outwards.x() == 0.0 ? 0.0 : kHouseDepth + 0.1);
    build(side, 2.0 * (side.half_length - corner), builder.dice());
  }
  for (const Side& side : sidesOf(half)) park(side, builder);
  for (const Side& side : sidesOf(half)) plant(side, builder.dice());
  for (const char* name : {"bicycle", "bicycle", "person"}) addSomewhere(name, builder);
}

void Block::build(const Side& side, double length, Dice& dice) {
  double from = -0.5 * length;
  while (0.5 * length - from > 4.0) {
    const double left = 0.5 * length - from;
    const double wide = dice.uniform(8.0, 17.0);
    // A rest that is too narrow for a further house is added to this house.
    const Eigen::Vector3d size(left - wide < 6.0 ? left : wide, kHouseDepth,
                               dice.uniform(5.5, 13.0));
    add(PropKind::kFacade, size,
        side.at(from + 0.5 * size.x(), -kPavementWidth - 0.5 * kHouseDepth, M_PI));
    from += size.x() + 0.05;
  }
}

void Block::park(const Side& side, SceneBuilder& builder) {
  Dice& dice = builder.dice();
  const double end = side.half_length - kNoParking;
  double from = -end + dice.uniform(0.0, 2.0);
  while (from < end) {
    if (!dice.chance(kShareParked)) {
      from += dice.uniform(5.0, 9.0);
      continue;
    }
    SceneObject vehicle = builder.draw(dice.chance(kVanShare) ? "van" : "car");
    const double length = vehicle.size.x();
    if (from + length > end) return;
    const double outside = 0.18 + 0.5 * vehicle.size.y() + dice.uniform(-0.1, 0.1);
    const double turned = dice.chance(kReversedShare) ? M_PI : 0.0;
    add(std::move(vehicle),
        side.at(from + 0.5 * length, outside, turned + dice.uniform(-0.03, 0.03)), 0.25);
    from += length + std::min(0.6 - std::log(1.0 - dice.unit()), 6.0);
  }
}

void Block::plant(const Side& side, Dice& dice) {
  const double end = side.half_length - 2.0;
  for (double at = -end + dice.uniform(0.0, 10.0); at < end; at += dice.uniform(16.0, 30.0)) {
    const double crown = dice.uniform(2.2, 3.2);
    add(PropKind::kTree, {crown, crown, dice.uniform(6.5, 8.5)},
        side.at(at, -0.9, dice.uniform(-M_PI, M_PI)));
  }
  for (double at = -end + dice.uniform(0.0, 15.0); at < end; at += dice.uniform(20.0, 30.0)) {
    add(PropKind::kPole, {0.16, 0.16, dice.uniform(4.5, 7.0)}, side.at(at, -0.45, 0.0));
  }
}

bool Block::fits(const Solid& solid, double margin) const {
  const auto meets = [&](const Solid& other) { return meet(solid, other, margin); };
  for (const Scenery& prop : scenery_) {
    const auto solids = solidsOf(Prop{prop.kind, 0, prop.size, poseOf(prop.place, prop.size.z())});
    if (std::ranges::any_of(solids, meets)) return false;
  }
  return std::ranges::none_of(
      things_, [&](const Thing& thing) { return meets(solidAt(thing.place, thing.object.size)); });
}

bool Block::add(SceneObject object, const Place& place, double margin) {
  if (!fits(solidAt(place, object.size), margin)) return false;
  things_.push_back({std::move(object), place});
  return true;
}

bool Block::add(PropKind kind, const Eigen::Vector3d& size, const Place& place) {
  const auto solids = solidsOf(Prop{kind, 0, size, poseOf(place, size.z())});
  const auto fit = [&](const Solid& solid) { return fits(solid, 0.02); };
  if (!std::ranges::all_of(solids, fit)) return false;
  scenery_.push_back({kind, size, place});
  return true;
}

/// Adds an object at a free place on any side. Returns false if no place is free.
bool Block::addSomewhere(const std::string& class_name, SceneBuilder& builder) {
  constexpr int kAttempts = 40;
  Dice& dice = builder.dice();
  const SceneObject object = builder.draw(class_name);
  const bool vehicle = class_name == "car" || class_name == "van";
  const bool person = class_name == "person";
  for (int i = 0; i < kAttempts; ++i) {
    const Side side = dice.pick(sidesOf(half_));
    const double end = side.half_length - kNoParking - (vehicle ? 0.5 * object.size.x() : 0.0);
    const double outside = vehicle  ? 0.18 + 0.5 * object.size.y()
                           : person ? dice.uniform(0.6 - kPavementWidth, -0.6)
                                    : dice.uniform(-0.9, -0.55);
    const double yaw = person ? dice.uniform(-M_PI, M_PI)
                              : (dice.chance(0.5) ? M_PI : 0.0) + dice.uniform(-0.1, 0.1);
    if (add(object, side.at(dice.uniform(-end, end), outside, yaw), 0.25)) return true;
  }
  return false;
}

void Block::alter(std::size_t changes, SceneBuilder& builder) {
  constexpr double kTakenAway = 0.5;
  Dice& dice = builder.dice();
  while (changes > 0) {
    if (dice.chance(kTakenAway) && !things_.empty()) {
      things_.erase(things_.begin() + static_cast<std::ptrdiff_t>(dice.below(things_.size())));
      --changes;
      continue;
    }
    const double kind = dice.unit();
    const char* name = kind < 0.5 ? "bicycle" : kind < 0.7 ? "person" : "car";
    if (addSomewhere(name, builder)) --changes;
  }
}

void Block::putAt(const Eigen::Vector2d& middle, SceneBuilder& builder) const {
  const auto moved = [&](Place place) {
    place.point += middle;
    return place;
  };
  for (const Scenery& prop : scenery_) builder.mustPut(prop.kind, prop.size, moved(prop.place));
  for (const Thing& thing : things_) builder.mustPut(thing.object, moved(thing.place));
}

Eigen::Vector2d crossing(int column, int row) { return {kPitchX * column, kPitchY * row}; }

std::vector<Road> roadsOfBlocks() {
  std::vector<Road> roads;
  for (int row = -1; row <= kCrossingsY; ++row)
    roads.push_back({crossing(-1, row), crossing(kCrossingsX, row), kRoadWidth});
  for (int column = -1; column <= kCrossingsX; ++column)
    roads.push_back({crossing(column, -1), crossing(column, kCrossingsY), kRoadWidth});
  return roads;
}

/// The route follows three rows, crosses them along three columns, returns, repeats the first row,
/// and drives the last one in the opposite direction.
std::vector<Eigen::Vector2d> turnsAmongBlocks(Dice& dice) {
  const int right = kCrossingsX - 1, top = kCrossingsY - 1;
  const int third = 4 + static_cast<int>(dice.below(2)),
            second = 1 + static_cast<int>(dice.below(3));
  const bool mirror_x = dice.chance(0.5), mirror_y = dice.chance(0.5);
  std::vector<Eigen::Vector2d> points;
  for (const auto& [column, row] : std::vector<std::pair<int, int>>{{0, 0},
                                                                    {right, 0},
                                                                    {right, 2},
                                                                    {0, 2},
                                                                    {0, 4},
                                                                    {right, 4},
                                                                    {right, top},
                                                                    {third, top},
                                                                    {third, 0},
                                                                    {second, 0},
                                                                    {second, top},
                                                                    {0, top},
                                                                    {0, 0},
                                                                    {right, 0},
                                                                    {right, 4},
                                                                    {0, 4}}) {
    points.push_back(crossing(mirror_x ? right - column : column, mirror_y ? top - row : row));
  }
  return points;
}

/// For each block, the number of objects that differ from the template of all blocks.
std::vector<std::size_t> changesOf(Dice& dice) {
  std::vector<std::size_t> changes(kBlocks, 0);
  for (std::size_t i = 0; i < kBlocks; ++i) {
    if (i < kUnmistakable)
      changes[i] = 7 + dice.below(4);
    else if (i < kUnmistakable + kWithFewChanges)
      changes[i] = 1 + dice.below(2);
  }
  for (std::size_t i = kBlocks; i > 1; --i) std::swap(changes[i - 1], changes[dice.below(i)]);
  return changes;
}

void closeRoads(const std::vector<Road>& roads, SceneBuilder& builder) {
  constexpr double kDepth = 7.0, kFromEnd = 0.5 * kRoadWidth + 3.3 + 0.5 * kDepth;
  for (const Road& road : roads) {
    const Eigen::Vector2d way = (road.to - road.from).normalized();
    const double heading = std::atan2(way.y(), way.x());
    for (const bool at_end : {false, true}) {
      const Eigen::Vector3d size(kRoadWidth + 6.0, kDepth, builder.dice().uniform(6.0, 12.0));
      builder.mustPut(PropKind::kFacade, size,
                      {at_end ? Eigen::Vector2d(road.to + kFromEnd * way)
                              : Eigen::Vector2d(road.from - kFromEnd * way),
                       heading + (at_end ? -M_PI_2 : M_PI_2), 0.0});
    }
  }
}

void putBlocks(SceneBuilder& builder) {
  const Eigen::Vector2d half(0.5 * (kPitchX - kRoadWidth), 0.5 * (kPitchY - kRoadWidth));
  const Block original(half, builder);
  const auto changes = changesOf(builder.dice());
  for (std::size_t i = 0; i < kBlocks; ++i) {
    const auto column = static_cast<int>(i % (kCrossingsX + 1)) - 1;
    const auto row = static_cast<int>(i / (kCrossingsX + 1)) - 1;
    Block block = original;
    block.alter(changes[i], builder);
    block.putAt(0.5 * (crossing(column, row) + crossing(column + 1, row + 1)), builder);
  }
}

}  // namespace

Scene makeBlocks(std::uint64_t seed, const SceneOptions& options) {
  SceneBuilder builder("blocks", seed, options);
  const double seconds = builder.seconds(kBlocksSeconds);
  const GroundPath way = laneThrough(turnsAmongBlocks(builder.dice()));
  const SpeedLimits limits{10.5, 2.4, 1.7, 1.9};
  const Drive driven = drive(way, limits, 8.0, way.length() - 8.0, 1.2, seconds + 2.0);
  putOnWheels(builder, way, driven, seconds, options);
  const std::vector<Road> roads = roadsOfBlocks();
  builder.scene().ground = GroundKind::kStreet;
  builder.scene().roads = roads;
  putBlocks(builder);
  closeRoads(roads, builder);
  return builder.take();
}

}  // namespace perdure::sim
