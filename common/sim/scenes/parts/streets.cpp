#include "common/sim/scenes/parts/streets.h"

#include <algorithm>
#include <cmath>

#include "common/math/so3.h"
#include "common/sim/scenes/parts/rigs.h"

namespace perdure::sim {
namespace {

constexpr double kCrossingClearance = 3.5;  ///< parked vehicles to a crossing road's edge

Solid areaOf(const Road& road) {
  const Eigen::Vector2d way = road.to - road.from;
  return {0.5 * (road.from + road.to), std::atan2(way.y(), way.x()),
          Eigen::Vector2d(0.5 * way.norm(), 0.5 * road.width_m), 0.0, 1e3};
}

double lengthOf(const Road& road) { return (road.to - road.from).norm(); }

}  // namespace

std::vector<Road> gridOfRoads(int columns, int rows) {
  constexpr double kBeyond = 14.0;
  std::vector<Road> roads;
  const double length = kGridX * (columns - 1), width = kGridY * (rows - 1);
  for (int row = 0; row < rows; ++row) {
    const double y = kGridY * row;
    roads.push_back({{-kBeyond, y}, {length + kBeyond, y}, kRoadWidth});
  }
  for (int column = 0; column < columns; ++column) {
    const double x = kGridX * column;
    roads.push_back({{x, -kBeyond}, {x, width + kBeyond}, kRoadWidth});
  }
  return roads;
}

Furnishing furnishingOfGrid() {
  Furnishing furnishing;
  furnishing.free_share = 0.33;
  furnishing.tree_every = 30.0;
  furnishing.person_every = furnishing.bicycle_every = 90.0;
  return furnishing;
}

Streets::Streets(SceneBuilder& builder, std::vector<Road> roads, const Furnishing& furnishing)
    : builder_(builder), roads_(std::move(roads)), furnishing_(furnishing) {
  builder_.scene().ground = GroundKind::kStreet;
  builder_.scene().roads = roads_;
}

/// `across`: distance from the centre line towards that side. `yaw`: relative to that side's
/// traffic.
Place Streets::placeAt(const Road& road, int side, double along, double across, double yaw) const {
  const Eigen::Vector2d way = (road.to - road.from).normalized(), left(-way.y(), way.x());
  const double heading = std::atan2(way.y(), way.x()) + (side > 0 ? M_PI : 0.0);
  return {road.from + along * way + side * across * left, wrapAngle(heading + yaw), 0.0};
}

bool Streets::onAnotherRoad(const Road& road, const Solid& solid, double margin) const {
  return std::ranges::any_of(roads_, [&](const Road& other) {
    const bool same = other.from == road.from && other.to == road.to;
    return !same && meet(areaOf(other), solid, margin);
  });
}

void Streets::put(const Road& road, PropKind kind, const Eigen::Vector3d& size,
                  const Place& place) {
  if (!onAnotherRoad(road, solidAt(place, size), 0.5)) builder_.put(kind, size, place);
}

void Streets::furnish() {
  // Houses come first, because they are the largest; other objects use the remaining space.
  for (const Road& road : roads_) {
    for (const int side : {-1, 1}) furnishing_.garden > 0.0 ? plots(road, side) : build(road, side);
    if (furnishing_.ends) closeEnds(road);
  }
  for (const Road& road : roads_) {
    for (const int side : {-1, 1}) {
      park(road, side);
      plant(road, side);
      people(road, side);
    }
  }
}

void Streets::build(const Road& road, int side) {
  Dice& dice = builder_.dice();
  for (double along = 0.0; along < lengthOf(road) - 3.0;) {
    const double set_back =
        furnishing_.pavement + (dice.chance(0.25) ? dice.uniform(0.5, 2.5) : 0.05);
    const Eigen::Vector3d size(dice.uniform(8.0, 17.0), 7.0, dice.uniform(5.5, 13.0));
    bool built = false;
    for (double length = size.x(); length >= 4.0 && !built; length *= 0.6) {
      const Eigen::Vector3d shorter(length, size.y(), size.z());
      // The front (−y) of the house faces the road.
      const Place place = placeAt(road, side, along + 0.5 * length,
                                  0.5 * road.width_m + set_back + 0.5 * size.y(), M_PI);
      const Solid solid = solidAt(place, shorter);
      built = !onAnotherRoad(road, solid, furnishing_.pavement) &&
              builder_.put(PropKind::kFacade, shorter, place);
      if (built) along += length + (dice.chance(0.2) ? dice.uniform(1.5, 5.0) : 0.1);
    }
    if (!built) along += 2.0;
  }
}

void Streets::plots(const Road& road, int side) {
  for (double along = 0.0; along < lengthOf(road) - 13.0;) {
    const double length = builder_.dice().uniform(13.0, 19.0);
    if (plot(road, side, along, length)) {
      along += length;
    } else {  // beside the last plot before a crossing road
      fence(road, placeAt(road, side, along + 1.0, 0.5 * road.width_m + 1.5, M_PI), 1.98);
      along += 2.0;
    }
  }
}

/// Adds a hedge or a wall along the x axis of `place`.
void Streets::fence(const Road& road, const Place& place, double length) {
  Dice& dice = builder_.dice();
  const bool hedge = dice.chance(0.6);
  put(road, hedge ? PropKind::kHedge : PropKind::kWall,
      {length, hedge ? 0.6 : 0.2, dice.uniform(1.0, 1.8)}, place);
}

/// Adds a plot with a driveway at one end. A hedge or a wall may follow the pavement, and another
/// may separate the driveway from the neighbour.
bool Streets::plot(const Road& road, int side, double from, double length) {
  constexpr double kDriveway = 3.2, kHouseDepth = 7.0, kParkingStrip = 2.2;
  Dice& dice = builder_.dice();
  const double kerb = 0.5 * road.width_m, line = kerb + dice.uniform(1.0, 2.0);
  const bool drive_first = dice.chance(0.5);
  const double rest = length - kDriveway,
               middle = from + 0.5 * (drive_first ? length + kDriveway : rest);
  const double drive_at = drive_first ? from + 0.5 * kDriveway : from + length - 0.5 * kDriveway;
  const Eigen::Vector3d house(rest - 0.4, kHouseDepth, dice.uniform(5.5, 10.0));
  const Place at = placeAt(road, side, middle, line + furnishing_.garden + 0.5 * kHouseDepth, M_PI);
  if (onAnotherRoad(road, solidAt(at, house), furnishing_.pavement + 1.0) ||
      !builder_.put(PropKind::kFacade, house, at)) {
    return false;
  }
  const double enclosed = dice.unit();  // selects which of the two fences exist
  if (enclosed < 0.6) fence(road, placeAt(road, side, middle, line + 0.3, M_PI), rest - 0.2);
  const double border = drive_first ? from + 0.2 : from + length - 0.2;
  if (enclosed > 0.4 && enclosed < 0.9) {
    const double across = line + 0.7 + 0.5 * furnishing_.garden;
    fence(road, placeAt(road, side, border, across, M_PI_2), furnishing_.garden - 0.8);
  }
  if (dice.chance(0.75)) {
    SceneObject car = builder_.draw(dice.chance(furnishing_.van_share) ? "van" : "car");
    const double across = line + 0.6 + 0.5 * car.size.x() + dice.uniform(0.0, 1.5);
    builder_.put(std::move(car),
                 placeAt(road, side, drive_at, across, (dice.chance(0.5) ? M_PI_2 : -M_PI_2)));
  }
  builder_.reserve(solidAt(placeAt(road, side, drive_at, 0.5 * (kerb + line - kParkingStrip), 0.0),
                           {kDriveway, line - kerb + kParkingStrip, 2.0}));
  return true;
}

void Streets::closeEnds(const Road& road) {
  const Eigen::Vector2d way = (road.to - road.from).normalized();
  const double heading = std::atan2(way.y(), way.x());
  for (const bool at_end : {false, true}) {
    const Eigen::Vector3d size(road.width_m + 2.0 * furnishing_.pavement + 3.0, 7.0,
                               builder_.dice().uniform(6.0, 12.0));
    const Eigen::Vector2d end = at_end ? road.to : road.from;
    const Eigen::Vector2d point = end + (at_end ? 7.0 : -7.0) * way;
    const Place place{point, wrapAngle(heading + (at_end ? -M_PI_2 : M_PI_2)), 0.0};
    put(road, PropKind::kFacade, size, place);
  }
}

void Streets::park(const Road& road, int side) {
  Dice& dice = builder_.dice();
  for (double along = dice.uniform(0.5, 4.0); along < lengthOf(road) - 3.0;) {
    if (dice.chance(furnishing_.free_share)) {
      along += dice.uniform(5.0, 11.0);
      continue;
    }
    SceneObject vehicle = builder_.draw(dice.chance(furnishing_.van_share) ? "van" : "car");
    const double across =
        0.5 * road.width_m - 0.18 - 0.5 * vehicle.size.y() + dice.uniform(-0.1, 0.1);
    const double turned = dice.chance(furnishing_.reversed_share) ? M_PI : 0.0;
    const double length = vehicle.size.x();
    const Place place =
        placeAt(road, side, along + 0.5 * length, across, turned + dice.uniform(-0.03, 0.03));
    const bool stands = !onAnotherRoad(road, solidAt(place, vehicle.size), kCrossingClearance) &&
                        builder_.put(std::move(vehicle), place, 0.25);
    // Many gaps are small, and few are large.
    const double gap = 0.6 - (furnishing_.mean_gap - 0.6) * std::log(1.0 - dice.unit());
    along += stands ? length + std::min(gap, 6.0) : 1.0;
    if (stands && furnishing_.island_share > 0.0 && dice.chance(furnishing_.island_share)) {
      const Eigen::Vector3d size(dice.uniform(1.2, 2.5), 1.8, dice.uniform(1.5, 1.8));
      put(road, PropKind::kHedge, size,
          placeAt(road, side, along + 0.5 * size.x(), 0.5 * road.width_m - 1.1, M_PI));
      along += size.x() + 0.6;
    }
  }
}

void Streets::plant(const Road& road, int side) {
  Dice& dice = builder_.dice();
  const double kerb = 0.5 * road.width_m;
  for (double along = 2.0; along < lengthOf(road);
       along += dice.uniform(0.7, 1.3) * furnishing_.tree_every) {
    const double crown = dice.uniform(2.2, 3.2);
    const Place place = placeAt(road, side, along, kerb + 0.9, dice.uniform(-M_PI, M_PI));
    const Eigen::Vector3d size(crown, crown, dice.uniform(6.5, 8.5));
    put(road, PropKind::kTree, size, place);
  }
  for (double along = 6.0; along < lengthOf(road);
       along += dice.uniform(0.8, 1.2) * furnishing_.pole_every) {
    const Place place = placeAt(road, side, along, kerb + 0.45, 0.0);
    const Eigen::Vector3d size(0.16, 0.16, dice.uniform(4.5, 7.0));
    put(road, PropKind::kPole, size, place);
  }
  for (double along = 3.0; along < lengthOf(road) - 6.0; along += 9.0) {
    if (!dice.chance(furnishing_.hedge_share)) continue;
    // A hedge stands between the cars and the pavement, or in front of the houses.
    const bool at_kerb = dice.chance(0.4);
    const Eigen::Vector3d size(dice.uniform(2.5, 6.0), dice.uniform(0.5, 0.7),
                               dice.uniform(0.7, 1.5));
    const double across = at_kerb ? kerb + 0.55 : kerb + furnishing_.pavement - 0.4;
    const Place place = placeAt(road, side, along + 0.5 * size.x(), across, M_PI);
    put(road, PropKind::kHedge, size, place);
  }
}

void Streets::people(const Road& road, int side) {
  Dice& dice = builder_.dice();
  const double kerb = 0.5 * road.width_m;
  const auto along_the_pavement = [&](const std::string& class_name, double every) {
    for (double along = dice.uniform(0.0, every); along < lengthOf(road);
         along += dice.uniform(0.4, 1.6) * every) {
      const bool person = class_name == "person";
      const double across =
          kerb + (person ? dice.uniform(0.6, furnishing_.pavement - 0.6) : dice.uniform(0.55, 0.9));
      const double yaw = person ? dice.uniform(-M_PI, M_PI)
                                : (dice.chance(0.5) ? M_PI : 0.0) + dice.uniform(-0.2, 0.2);
      SceneObject thing = builder_.draw(class_name);
      const Place place = placeAt(road, side, along, across, yaw);
      if (!onAnotherRoad(road, solidAt(place, thing.size), 0.3))
        builder_.put(std::move(thing), place);
    }
  };
  along_the_pavement("person", furnishing_.person_every);
  along_the_pavement("bicycle", furnishing_.bicycle_every);
}

GroundPath laneThrough(const std::vector<Eigen::Vector2d>& points) {
  const auto rightOf = [](const Eigen::Vector2d& way) {
    return Eigen::Vector2d(way.y(), -way.x());
  };
  std::vector<Corner> corners;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector2d in = (points[i] - points[i > 0 ? i - 1 : 0]).normalized();
    const Eigen::Vector2d out =
        (points[std::min(i + 1, points.size() - 1)] - points[i]).normalized();
    const bool end = i == 0 || i + 1 == points.size();
    const bool ahead = !end && in.dot(out) > 0.9;
    if (ahead) continue;
    const bool left = in.x() * out.y() - in.y() * out.x() > 0;
    const Eigen::Vector2d offset = end ? rightOf(i == 0 ? out : in) : rightOf(in) + rightOf(out);
    corners.push_back({points[i] + kLane * offset, left ? 14.0 : 8.0});
  }
  return GroundPath(corners, false);
}

void drawDaylight(SceneBuilder& builder) {
  Dice& dice = builder.dice();
  const double azimuth = dice.uniform(-M_PI, M_PI), height = dice.uniform(0.5, 1.15);
  builder.scene().sun_W = {std::cos(height) * std::cos(azimuth),
                           std::cos(height) * std::sin(azimuth), std::sin(height)};
  builder.scene().sun_strength = dice.uniform(0.7, 1.1);
  builder.scene().sky_strength = dice.uniform(0.4, 0.6);
}

void putOnWheels(SceneBuilder& builder, const GroundPath& way, const Drive& driven, double seconds,
                 const SceneOptions& options) {
  constexpr double kHeightOfCamera = 1.6;
  Suspension suspension;
  suspension.height = kHeightOfCamera - kCameraAboveBody;
  suspension.seed = builder.dice().seed();
  builder.setBody(vehicleMotion(way, driven, suspension), seconds, 1.15, 2.2);
  builder.scene().rig = makeRig(Carrier::kVehicle, options, builder.dice(), 0.02);
  drawDaylight(builder);
}

}  // namespace perdure::sim
