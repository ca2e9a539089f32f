// Transforms objects into M, the frame in which the map is consistent. An object is stored in the W
// of the session that observed it last. The anchor A of its last detection determines the pose of W
// in M: T_MW = T_MA T_WA⁻¹.
//
// M of a component of the graph is the W of the session of its first anchor. Its z axis points
// against gravity.
#pragma once

#include <map>
#include <utility>
#include <vector>

#include "common/mapping/map_state.h"
#include "common/types/objects.h"

namespace perdure::mapping {

/// The pose of W in M near an anchor.
struct FrameInMap {
  RigidTransform T_MW;
  WorldId map;               ///< M
  bool provisional = false;  ///< the session is not linked to the map's first anchor yet
};

/// Computes the poses at construction; later changes of the graph have no effect.
class MapFrames {
 public:
  MapFrames() = default;
  MapFrames(const PoseGraph& graph, const std::map<AnchorId, Anchor>& anchors);
  explicit MapFrames(const MapState& state) : MapFrames(state.graph(), state.anchors()) {}

  /// Returns the anchor of an object's stored belief; 0 if its session has no anchor. `world` is
  /// the W of the belief, `last_seen` the time of its last detection. The anchor is that of the
  /// record if the record is of the same detection, else the session's last anchor at that time.
  AnchorId anchorOf(const ObjectRecord* record, const WorldId& world, TimePoint last_seen) const;

  /// Returns the frame near an anchor. If the anchor is 0 or unknown, M is `world` and T_MW is the
  /// identity.
  FrameInMap at(AnchorId anchor, const WorldId& world) const;

  /// Returns the M of a session's newest anchor; the session's W if it has no anchor.
  WorldId mapOf(const WorldId& session) const;

 private:
  std::map<AnchorId, FrameInMap> by_anchor_;
  std::map<WorldId, std::vector<std::pair<TimePoint, AnchorId>>> by_time_;
};

}  // namespace perdure::mapping
