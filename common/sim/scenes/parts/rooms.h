// Rooms: walls, tables with chairs and monitors, couches, shelves; and how someone walks in them.
#pragma once

#include "common/sim/path.h"
#include "common/sim/scenes/parts/builder.h"

namespace perdure::sim {

inline constexpr double kWallHeight = 2.8;

/// A room about the origin of W. What stands along its walls faces inwards.
class Room {
 public:
  Room(SceneBuilder& builder, double length, double width);

  /// A table with `chairs` of 0 to 6 around it and `monitors` of 0 to 2 on it. False where there
  /// is no room for the table; chairs that find none are left out.
  bool putTable(const Eigen::Vector2d& point, double yaw, int chairs, int monitors);
  /// A table at the wall with a monitor on it and a chair before it.
  bool putDesk(const Eigen::Vector2d& at_wall, double inwards);
  /// Desks, couches, shelves, crates and people along all four walls.
  void furnishWalls();
  /// Tries `count` things of the class anywhere on the floor.
  void scatter(const std::string& class_name, int count);
  void scatterCrates(int count);

  double length() const { return length_; }
  double width() const { return width_; }

 private:
  bool putAtWall(const Eigen::Vector2d& at_wall, double inwards, double& taken);
  bool putMonitor(const SceneObject& table, const Place& table_place, double forwards, double left,
                  double yaw);

  SceneBuilder& builder_;
  double length_, width_;
};

/// Where someone who walks looks: about the way's direction, to and fro.
struct Gaze {
  double swing = 1.0, period_s = 13.0;  ///< of the yaw, radians to each side
  double second_swing = 0.18, second_period_s = 4.7;
  double middle = 0.0;                                ///< relative to the way
  double pitch_down = 0.12, nod = 0.07, tilt = 0.05;  ///< radians
};

/// A camera in the hand of someone who walks: steps, sway and a gaze that wanders.
Trajectory handheldMotion(const GroundPath& path, const Drive& drive, const Gaze& gaze,
                          double height);
/// The same for someone whose way and gaze are given: one place and yaw (and pitch) every interval.
struct Look {
  Eigen::Vector2d point = Eigen::Vector2d::Zero();
  double yaw = 0.0, pitch_down = 0.0, roll = 0.0;
};
Trajectory handheldMotion(const std::vector<Look>& looks, double interval_s, double height);

}  // namespace perdure::sim
