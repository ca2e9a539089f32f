// Fills streets with parked cars and vans, houses, trees, poles, hedges, people and bicycles.
#pragma once

#include <vector>

#include "common/sim/path.h"
#include "common/sim/scenes/parts/builder.h"

namespace perdure::sim {

struct Furnishing {
  double mean_gap = 1.6;         ///< gap between parked vehicles
  double free_share = 0.22;      ///< share of empty slots, 5 to 11 m long
  double van_share = 0.16;       ///< share of vans among parked vehicles
  double reversed_share = 0.12;  ///< share of vehicles parked against the traffic
  double tree_every = 15.0, pole_every = 27.0;
  double person_every = 26.0, bicycle_every = 24.0;  ///< spacing along the pavement
  double hedge_share = 0.3;                          ///< share of houses with a hedge in front
  double pavement = 3.2;                             ///< width
  double island_share = 0.0;  ///< share of parked vehicles followed by a hedge in the row of cars
  double garden = 0.0;        ///< depth of front gardens; 0: none
  bool ends = true;           ///< a house stands at each road's end
};

inline constexpr double kRoadWidth = 10.0;  ///< two lanes and two rows of parked cars
inline constexpr double kLane = 1.4;        ///< road's centre line to the centre of a lane

inline constexpr double kGridX = 82.0, kGridY = 66.0;  ///< distance between roads
/// Roads in rows (along x) and columns (along y). The first crossing is at the origin.
std::vector<Road> gridOfRoads(int columns, int rows);
/// Furnishing with a third of the parking slots free, and few trees and people.
Furnishing furnishingOfGrid();

/// Straight roads that may cross, with objects on both sides.
class Streets {
 public:
  Streets(SceneBuilder& builder, std::vector<Road> roads, const Furnishing& furnishing);
  /// The body's motion must already be set, because nothing is placed on its path.
  void furnish();
  /// Parks vehicles only, on one side (+1 left of the road's direction, -1 right) of one road.
  void park(const Road& road, int side);
  void build(const Road& road, int side);
  /// Adds plots with a house, a front garden and a driveway, instead of build().
  void plots(const Road& road, int side);
  void plant(const Road& road, int side);
  void people(const Road& road, int side);

 private:
  bool plot(const Road& road, int side, double from, double length);
  void fence(const Road& road, const Place& place, double length);
  Place placeAt(const Road& road, int side, double along, double across, double yaw) const;
  bool onAnotherRoad(const Road& road, const Solid& solid, double margin) const;
  void put(const Road& road, PropKind kind, const Eigen::Vector3d& size, const Place& place);
  void closeEnds(const Road& road);

  SceneBuilder& builder_;
  std::vector<Road> roads_;
  Furnishing furnishing_;
};

/// A path on the right-hand lane that turns at these crossings and ends at the first and the last
/// point. Right turns are tighter than left turns.
GroundPath laneThrough(const std::vector<Eigen::Vector2d>& points);
void drawDaylight(SceneBuilder& builder);
/// Makes the body a car with this drive for `seconds`, with a car's sensors, in daylight.
void putOnWheels(SceneBuilder& builder, const GroundPath& way, const Drive& driven, double seconds,
                 const SceneOptions& options);

}  // namespace perdure::sim
