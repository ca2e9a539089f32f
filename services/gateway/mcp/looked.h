// The ground that the cameras have looked at from the map's anchors. A point was looked at if it
// lies in the field of view of an anchor, within reach, and no object on the map is in between.
// Objects and walls that are not on the map are ignored.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "services/gateway/mcp/arguments.h"
#include "services/gateway/mcp/map.h"

namespace perdure::gateway::mcp {

class Looked {
 public:
  /// Reads what is around the place of the conditions. Throws NoAnswer if the map lacks the fields
  /// of view or objects. `reach` is the distance up to which nine of ten objects were detected.
  Looked(Map& map, const State& state, const Conditions& conditions);

  double reach() const { return reach_m_; }
  std::size_t anchors() const { return anchors_.size(); }
  /// Whether the point of the ground plane, in M, was looked at.
  bool at(const Eigen::Vector2d& p) const;
  /// Returns the number of objects of the conditions' class per m² of ground that was looked at
  /// around the place; nothing if none was.
  std::optional<double> density(const Conditions& conditions) const;

  struct Region {
    Eigen::Vector2d centre = Eigen::Vector2d::Zero();
    double area_m2 = 0.0;
    double share = 0.0;  ///< share of its area that was never looked at, [0.5, 1]
  };
  /// Returns the connected regions of a disc that were mostly not looked at, largest first.
  std::vector<Region> unseen(const Eigen::Vector2d& centre, double radius_m) const;
  /// Returns the area of a disc that was never looked at, m².
  double unseenArea(const Eigen::Vector2d& centre, double radius_m) const;

 private:
  struct Cell;
  std::vector<Cell> cellsOf(const Eigen::Vector2d& centre, double radius_m) const;
  bool isHidden(const Eigen::Vector3d& from, const Eigen::Vector2d& p) const;

  std::vector<MapAnchor> anchors_;
  std::vector<mapping::Sight> cameras_;
  double reach_m_;
  std::vector<MapObject> objects_;
};

}  // namespace perdure::gateway::mcp
