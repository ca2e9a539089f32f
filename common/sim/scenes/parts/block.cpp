#include "common/sim/scenes/parts/block.h"

#include <algorithm>
#include <cmath>

#include "common/math/so3.h"

namespace perdure::sim {
namespace {

constexpr double kPavementWidth = 3.25, kHouseDepth = 7.0;
constexpr double kNoParking = 3.5;  ///< distance from the crossing road's edge
constexpr double kShareParked = 0.68, kVanShare = 0.16, kReversedShare = 0.12;

}  // namespace

struct Block::Side {
  Eigen::Vector2d outwards, along;  ///< along: the direction of the traffic on this side
  double from_middle = 0.0, half_length = 0.0;

  /// `outside`: distance beyond the kerb towards the road, negative on the pavement.
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
    // Houses of two sides fill the corners.
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
    // A remainder that is too narrow for a separate house is added to this one.
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

/// Adds an object at a free place on some side. Returns false if no place is found.
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

}  // namespace perdure::sim
