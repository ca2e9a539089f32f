#include "common/mapping/map_frames.h"

#include <algorithm>

#include "common/mapping/graph/components.h"

namespace perdure::mapping {

MapFrames::MapFrames(const PoseGraph& graph, const std::map<AnchorId, Anchor>& anchors) {
  if (anchors.empty()) return;
  const auto components = componentsOf(graph);
  const AnchorId first_of_all = components.at(anchors.begin()->first);
  for (const auto& [id, anchor] : anchors) {
    const AnchorId first = components.at(id);
    by_anchor_.emplace_hint(by_anchor_.end(), id,
                            FrameInMap{graph.pose(id).rigid() * anchor.T_WA.inverse(),
                                       anchors.at(first).session, first != first_of_all});
    by_time_[anchor.session].emplace_back(anchor.stamp.time, id);
  }
  for (auto& [session, times] : by_time_) std::sort(times.begin(), times.end());
}

AnchorId MapFrames::anchorOf(const ObjectRecord* record, const WorldId& world,
                             TimePoint last_seen) const {
  const bool is_of_it =
      record != nullptr && record->session == world && record->last_seen == last_seen;
  if (is_of_it && by_anchor_.contains(record->sighting.anchor)) return record->sighting.anchor;
  const auto session = by_time_.find(world);
  if (session == by_time_.end()) return 0;
  const auto& times = session->second;
  const auto after =
      std::upper_bound(times.begin(), times.end(), last_seen,
                       [](TimePoint time, const auto& entry) { return time < entry.first; });
  return after == times.begin() ? after->second : std::prev(after)->second;
}

FrameInMap MapFrames::at(AnchorId anchor, const WorldId& world) const {
  const auto found = by_anchor_.find(anchor);
  return found == by_anchor_.end() ? FrameInMap{{}, world, false} : found->second;
}

WorldId MapFrames::mapOf(const WorldId& session) const {
  const auto found = by_time_.find(session);
  return found == by_time_.end() ? session : by_anchor_.at(found->second.back().second).map;
}

}  // namespace perdure::mapping
