#include "common/sim/scenes/parts/rooms.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "common/math/so3.h"

namespace perdure::sim {
namespace {

constexpr double kWall = 0.15;  ///< thickness

Eigen::Vector2d turned(double forwards, double left, double yaw) {
  return {std::cos(yaw) * forwards - std::sin(yaw) * left,
          std::sin(yaw) * forwards + std::cos(yaw) * left};
}

}  // namespace

Room::Room(SceneBuilder& builder, double length, double width)
    : builder_(builder), length_(length), width_(width) {
  Scene& scene = builder.scene();
  scene.ground = GroundKind::kRoom;
  Dice& dice = builder.dice();
  scene.sun_W = Eigen::Vector3d(dice.uniform(-0.6, 0.6), dice.uniform(-0.6, 0.6), 1.0).normalized();
  scene.sun_strength = dice.uniform(0.25, 0.6);
  scene.sky_strength = dice.uniform(0.6, 0.9);
  const double x = 0.5 * (length + kWall), y = 0.5 * (width + kWall);
  const Eigen::Vector3d along_x(length, kWall, kWallHeight);
  const Eigen::Vector3d along_y(width + 2.0 * kWall, kWall, kWallHeight);
  // The front (−y) of each wall faces the inside of the room.
  builder.mustPut(PropKind::kWall, along_x, {{0, y}, 0.0, 0.0});
  builder.mustPut(PropKind::kWall, along_x, {{0, -y}, M_PI, 0.0});
  builder.mustPut(PropKind::kWall, along_y, {{x, 0}, -M_PI_2, 0.0});
  builder.mustPut(PropKind::kWall, along_y, {{-x, 0}, M_PI_2, 0.0});
}

bool Room::putMonitor(const SceneObject& table, const Place& table_place, double forwards,
                      double left, double yaw) {
  Place place = table_place;
  place.point += turned(forwards, left, table_place.yaw);
  place.yaw = wrapAngle(table_place.yaw + yaw);
  place.low = table.size.z();
  return builder_.put(builder_.draw("monitor"), place, 0.02);
}

bool Room::putTable(const Eigen::Vector2d& point, double yaw, int chairs, int monitors) {
  Dice& dice = builder_.dice();
  const SceneObject table = builder_.draw("dining table");
  const Place place{point, yaw, 0.0};
  if (!builder_.put(table, place)) return false;
  for (int i = 0; i < monitors; ++i) {
    const double left = monitors == 1 ? dice.uniform(-0.1, 0.1) : (i - 0.5) * 0.5 * table.size.y();
    putMonitor(table, place, dice.uniform(-0.12, 0.12), left, dice.uniform(-0.3, 0.3));
  }
  // Two chairs at each long side, then one at each end; all chairs face the table.
  struct Seat {
    double side, end;
  };
  constexpr std::array<Seat, 6> kSeats{
      {{1, 0.24}, {-1, -0.24}, {1, -0.24}, {-1, 0.24}, {0, 1}, {0, -1}}};
  for (std::size_t i = 0;
       i < std::min<std::size_t>(kSeats.size(), static_cast<std::size_t>(chairs)); ++i) {
    SceneObject chair = builder_.draw("chair");
    const double gap = dice.uniform(0.08, 0.25) + 0.5 * chair.size.x();
    const Seat& seat = kSeats[i];
    const double forwards = seat.side * (0.5 * table.size.x() + gap);
    const double left =
        seat.side != 0 ? seat.end * table.size.y() : seat.end * (0.5 * table.size.y() + gap);
    const double faces = std::atan2(seat.side != 0 ? 0.0 : -left, seat.side != 0 ? -forwards : 0.0);
    builder_.put(std::move(chair),
                 {point + turned(forwards, left, yaw),
                  wrapAngle(yaw + faces + dice.uniform(-0.25, 0.25)), 0.0},
                 0.03);
  }
  return true;
}

bool Room::putDesk(const Eigen::Vector2d& at_wall, double inwards) {
  Dice& dice = builder_.dice();
  const SceneObject table = builder_.draw("dining table");
  const Place place{at_wall + turned(0.5 * table.size.x() + 0.06, 0, inwards), inwards, 0.0};
  if (!builder_.put(table, place, 0.03)) return false;
  putMonitor(table, place, -0.15, dice.uniform(-0.25, 0.25), dice.uniform(-0.2, 0.2));
  SceneObject chair = builder_.draw("chair");
  const double before = 0.5 * (table.size.x() + chair.size.x()) + dice.uniform(0.08, 0.3);
  builder_.put(std::move(chair),
               {place.point + turned(before, dice.uniform(-0.2, 0.2), inwards),
                wrapAngle(inwards + M_PI + dice.uniform(-0.5, 0.5)), 0.0},
               0.03);
  return true;
}

bool Room::putAtWall(const Eigen::Vector2d& at_wall, double inwards, double& taken) {
  Dice& dice = builder_.dice();
  const double kind = dice.unit();
  if (kind < 0.3) {
    taken = 2.0;
    return putDesk(at_wall, inwards);
  }
  if (kind < 0.5) {
    const Eigen::Vector3d size(dice.uniform(0.8, 1.4), 0.35, dice.uniform(1.0, 2.0));
    taken = size.x() + 0.2;
    // A shelf's front is −y.
    return builder_.put(PropKind::kShelf, size,
                        {at_wall + turned(0.22, 0, inwards), wrapAngle(inwards + M_PI_2), 0.0});
  }
  if (kind < 0.62) {
    const Eigen::Vector3d size(dice.uniform(0.4, 0.7), dice.uniform(0.35, 0.5),
                               dice.uniform(0.3, 0.6));
    taken = size.x() + 0.3;
    return builder_.put(PropKind::kCrate, size,
                        {at_wall + turned(0.4, 0, inwards), wrapAngle(inwards + M_PI_2), 0.0});
  }
  SceneObject thing = builder_.draw(kind < 0.82 ? "couch" : kind < 0.94 ? "chair" : "person");
  taken = thing.size.y() + 0.3;
  const double from_wall = 0.5 * thing.size.x() + 0.12;
  return builder_.put(std::move(thing), {at_wall + turned(from_wall, 0, inwards),
                                         wrapAngle(inwards + dice.uniform(-0.08, 0.08)), 0.0});
}

void Room::furnishWalls() {
  Dice& dice = builder_.dice();
  for (int wall = 0; wall < 4; ++wall) {
    const double inwards = wrapAngle(wall * M_PI_2 + M_PI);  // the wall is at +x, +y, −x or −y
    const double run = wall % 2 == 0 ? width_ : length_;
    const double away = 0.5 * (wall % 2 == 0 ? length_ : width_);
    for (double along = 1.1; along < run - 1.1;) {
      double taken = 0.5;
      const Eigen::Vector2d at_wall = turned(-away, along - 0.5 * run, inwards);
      along += putAtWall(at_wall, inwards, taken) ? 0.6 * taken + dice.uniform(0.2, 0.9) : 0.25;
    }
  }
}

void Room::scatter(const std::string& class_name, int count) {
  Dice& dice = builder_.dice();
  for (int i = 0; i < count; ++i) {
    const SceneObject thing = builder_.draw(class_name);
    for (int attempt = 0; attempt < 12; ++attempt) {
      const Eigen::Vector2d point(dice.uniform(-0.5, 0.5) * (length_ - 1.0),
                                  dice.uniform(-0.5, 0.5) * (width_ - 1.0));
      if (builder_.put(thing, {point, dice.uniform(-M_PI, M_PI), 0.0}, 0.1)) break;
    }
  }
}

void Room::scatterCrates(int count) {
  Dice& dice = builder_.dice();
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector3d size(dice.uniform(0.3, 0.8), dice.uniform(0.3, 0.6),
                               dice.uniform(0.25, 0.9));
    const Eigen::Vector2d point(dice.uniform(-0.5, 0.5) * (length_ - 1.0),
                                dice.uniform(-0.5, 0.5) * (width_ - 1.0));
    builder_.put(PropKind::kCrate, size, {point, dice.uniform(-M_PI, M_PI), 0.0}, 0.1);
  }
}

}  // namespace perdure::sim
