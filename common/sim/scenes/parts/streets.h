// Fills streets: parked cars and vans, houses, trees, poles, hedges, people and bicycles.
#pragma once

#include <vector>

#include "common/sim/path.h"
#include "common/sim/scenes/parts/builder.h"

namespace perdure::sim {

/// Which things stand along a street, and how densely. Distances in metres.
struct Furnishing {
  double mean_gap = 1.6;         ///< between parked vehicles
  double free_share = 0.22;      ///< of slots that are empty, 5 to 11 m long
  double van_share = 0.16;       ///< of parked vehicles
  double reversed_share = 0.12;  ///< of vehicles parked against the traffic
  double tree_every = 15.0, pole_every = 27.0;
  double person_every = 26.0, bicycle_every = 24.0;  ///< of pavement
  double hedge_share = 0.3;                          ///< of the houses' fronts
  double pavement = 3.2;                             ///< width
  bool ends = true;                                  ///< a house closes each road's end
};

inline constexpr double kRoadWidth = 10.0;  ///< two lanes and two rows of parked cars
inline constexpr double kLane = 1.4;        ///< of a lane's middle from the road's

inline constexpr double kGridX = 82.0, kGridY = 66.0;  ///< between the roads of a grid
/// Roads in rows (along x) and columns, that go on a little beyond the outer crossings; the first
/// crossing is at the origin.
std::vector<Road> gridOfRoads(int columns, int rows);
/// How a grid of streets is furnished: a third of the slots free, few trees and people.
Furnishing furnishingOfGrid();

/// Straight roads that may cross, each with both its sides.
class Streets {
 public:
  Streets(SceneBuilder& builder, std::vector<Road> roads, const Furnishing& furnishing);
  /// The body's motion is set before: nothing is put in its way.
  void furnish();
  /// Vehicles only, on one side (+1 left of the road's direction, -1 right) of one road.
  void park(const Road& road, int side);
  void build(const Road& road, int side);
  void plant(const Road& road, int side);
  void people(const Road& road, int side);

 private:
  Place placeAt(const Road& road, int side, double along, double across, double yaw) const;
  bool onAnotherRoad(const Road& road, const Solid& solid, double margin) const;
  bool nearACrossing(const Road& road, const Solid& solid) const;
  void closeEnds(const Road& road);

  SceneBuilder& builder_;
  std::vector<Road> roads_;
  Furnishing furnishing_;
};

/// A way on the right-hand lane that turns at these crossings, the first and the last point are its
/// ends; right turns are tighter than left ones.
GroundPath laneThrough(const std::vector<Eigen::Vector2d>& points);
/// A light of the day: sun and sky.
void drawDaylight(SceneBuilder& builder);
/// The body as a car that drives so for `seconds`, with a car's sensors, by day.
void putOnWheels(SceneBuilder& builder, const GroundPath& way, const Drive& driven, double seconds,
                 const SceneOptions& options);

}  // namespace perdure::sim
