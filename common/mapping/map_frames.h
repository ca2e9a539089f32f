// How the objects of a map lie in M, the frame in which it is one. What is stored of an object is
// in the W of the session that saw it last; the anchor at which it was last detected says how W lay
// in M there: T_MW = T_MA T_WA⁻¹.
//
// M of a component of the graph is the W of the session of its first anchor. Its z axis is against
// gravity.
#pragma once

#include <map>
#include <utility>
#include <vector>

#include "common/mapping/map_state.h"
#include "common/types/objects.h"

namespace perdure::mapping {

/// How W lies in M beside an anchor.
struct FrameInMap {
  RigidTransform T_MW;
  WorldId map;               ///< M
  bool provisional = false;  ///< M is not that of the map's first anchor: not found there yet
};

/// As the graph has it when this is made.
class MapFrames {
 public:
  MapFrames() = default;
  MapFrames(const PoseGraph& graph, const std::map<AnchorId, Anchor>& anchors);
  explicit MapFrames(const MapState& state) : MapFrames(state.graph(), state.anchors()) {}

  /// The anchor that what is stored of an object belongs to; 0: none. `world` is its W, `last_seen`
  /// when it was last detected. By its record where that tells of the same detection; else, and
  /// where there is none, the last one of its session that was set until then.
  AnchorId anchorOf(const ObjectRecord* record, const WorldId& world, TimePoint last_seen) const;

  /// Beside an anchor. Of none, or one that is not known: M is `world`, and W is M.
  FrameInMap at(AnchorId anchor, const WorldId& world) const;

  /// The M that a session's newest anchor lies in; the session's own W where it has none.
  WorldId mapOf(const WorldId& session) const;

 private:
  std::map<AnchorId, FrameInMap> by_anchor_;
  std::map<WorldId, std::vector<std::pair<TimePoint, AnchorId>>> by_time_;
};

}  // namespace perdure::mapping
