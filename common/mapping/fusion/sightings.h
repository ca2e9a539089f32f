// Positions of objects in M, from the graph. Present objects have the position of their newest
// sighting; history has that of the anchor of its session at that time. Also finds objects of one
// drive that a later drive reports as gone.
#pragma once

#include <optional>
#include <vector>

#include "common/mapping/fusion/map_contents.h"
#include "common/mapping/map_state.h"

namespace perdure::mapping {

/// Components of the graph, and their names.
class PlacesInM {
 public:
  explicit PlacesInM(const SavedMap& map);

  struct Place {
    WorldId map;  ///< M: W of the first session of the component
    Eigen::Vector3d p = Eigen::Vector3d::Zero();
    AnchorId anchor = 0;
  };
  Place of(const ObjectRecord& record) const;
  /// The place of a belief stored in its session's W, relative to the last anchor of the session
  /// before the last sighting. Returns nothing if the session has no anchors.
  std::optional<Place> of(const StoredObject& object) const;

  const MapState& state() const { return state_; }
  AnchorId componentOf(AnchorId anchor) const { return components_.at(anchor); }

 private:
  Place inM(AnchorId anchor, const Eigen::Vector3d& p_A) const;

  MapState state_;
  std::map<AnchorId, AnchorId> components_;
  std::map<WorldId, std::map<TimePoint, AnchorId>> ways_;
};

/// Ends an object if another drive later found an object of the same class gone from its place. The
/// object becomes history. Missing observations alone are not evidence.
std::vector<Change> endWhatIsGone(MapContents& map);

}  // namespace perdure::mapping
