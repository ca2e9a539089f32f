// Furnished rooms (walls, tables, chairs, monitors, couches and shelves), and handheld motion in
// them.
#pragma once

#include "common/sim/path.h"
#include "common/sim/scenes/parts/builder.h"

namespace perdure::sim {

inline constexpr double kWallHeight = 2.8;

/// A room around the origin of W. Objects along its walls face the inside of the room.
class Room {
 public:
  Room(SceneBuilder& builder, double length, double width);

  /// Adds a table with 0 to 6 `chairs` around it and 0 to 2 `monitors` on it. Returns false if
  /// there is no space for the table; chairs without space are omitted.
  bool putTable(const Eigen::Vector2d& point, double yaw, int chairs, int monitors);
  /// Adds a table at the wall, with a monitor on it and a chair in front.
  bool putDesk(const Eigen::Vector2d& at_wall, double inwards);
  /// Places desks, couches, shelves, crates and people along all four walls.
  void furnishWalls();
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

/// A camera in the hand of a walking person: steps, sway, and a gaze that oscillates.
Trajectory handheldMotion(const GroundPath& path, const Drive& drive, double height);
/// The position and gaze of a walking person at one time.
struct Look {
  Eigen::Vector2d point = Eigen::Vector2d::Zero();
  double yaw = 0.0, pitch_down = 0.0, roll = 0.0;
};
Trajectory handheldMotion(const std::vector<Look>& looks, double interval_s, double height);

}  // namespace perdure::sim
