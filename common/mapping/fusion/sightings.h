// Where objects stand in M, by the graph: present ones by their newest sighting, history by the
// anchor of its session at that time. And what one drive no longer found of what another one saw.
#pragma once

#include <optional>
#include <vector>

#include "common/mapping/fusion/map_contents.h"
#include "common/mapping/map_state.h"

namespace perdure::mapping {

/// Components of the graph, and what they are called.
class PlacesInM {
 public:
  explicit PlacesInM(const SavedMap& map);

  struct Place {
    WorldId map;  ///< M: W of the first session of the component
    Eigen::Vector3d p = Eigen::Vector3d::Zero();
    AnchorId anchor = 0;
  };
  Place of(const ObjectRecord& record) const;
  /// Of a belief in its session's W, beside the anchor of its session before it was last seen;
  /// nothing where the session has no anchors.
  std::optional<Place> of(const StoredObject& object) const;

  const MapState& state() const { return state_; }
  AnchorId componentOf(AnchorId anchor) const { return components_.at(anchor); }

 private:
  Place inM(AnchorId anchor, const Eigen::Vector3d& p_A) const;

  MapState state_;
  std::map<AnchorId, AnchorId> components_;
  std::map<WorldId, std::map<TimePoint, AnchorId>> ways_;
};

/// Objects that stand where another drive has seen one of their class go, later than they were seen
/// last. They become history. Silence says nothing.
std::vector<Change> endWhatIsGone(MapContents& map);

}  // namespace perdure::mapping
