// Computes positions of objects in M from the graph: those of present objects from their newest
// sighting, those of history from their belief and an anchor of its session. Also finds objects of
// one drive that a later drive reports as gone.
#pragma once

#include <optional>
#include <vector>

#include "common/mapping/fusion/map_contents.h"
#include "common/mapping/map_state.h"

namespace perdure::mapping {

/// Positions in M by the graph of a map.
class PlacesInM {
 public:
  explicit PlacesInM(const SavedMap& map);

  struct Place {
    WorldId map;  ///< M: W of the first session of the component
    Eigen::Vector3d p = Eigen::Vector3d::Zero();
    AnchorId anchor = 0;
  };
  Place of(const ObjectRecord& record) const;
  /// Returns the place of a belief that is stored in its session's W. The session's last anchor
  /// before the last sighting transforms it to M. Returns nothing if the session has no anchors.
  std::optional<Place> of(const StoredObject& object) const;

  const MapState& state() const { return state_; }
  AnchorId componentOf(AnchorId anchor) const { return components_.at(anchor); }

 private:
  Place inM(AnchorId anchor, const Eigen::Vector3d& p_A) const;

  MapState state_;
  std::map<AnchorId, AnchorId> components_;
  std::map<WorldId, std::map<TimePoint, AnchorId>> ways_;
};

/// Ends an object if a later drive reported an object of the same class gone at its place. The
/// object becomes history. Missing observations alone do not end an object. Returns the changes.
std::vector<Change> endWhatIsGone(MapContents& map);

}  // namespace perdure::mapping
