#include "common/mapping/map_state.h"

#include <utility>
#include <vector>

namespace perdure::mapping {

MapState::MapState(const GraphParameters& parameters, SavedMap saved)
    : graph_(parameters),
      records_(std::move(saved.records)),
      merges_(std::move(saved.merges)),
      views_(std::move(saved.views)) {
  for (std::size_t k = 0; k < saved.classes.size(); ++k) {
    class_numbers_[saved.classes[k]] = static_cast<std::uint32_t>(k);
  }
  // Loops first: they keep their ids.
  for (const auto& [id, edge] : saved.edges) {
    if (edge.edge.kind == EdgeKind::kOdometry) continue;
    graph_.restore(id, edge.edge, edge.weight);
    saved_edges_[id] = edge.weight;
  }
  for (const auto& [id, saved_anchor] : saved.anchors) {
    const Anchor& anchor = saved_anchor.anchor;
    add(anchor);
    graph_.setPose(id, saved_anchor.T_MA);
    saved_anchors_[id] = {saved_anchor.T_MA, anchor.scale2};
  }
  graph_.holdFirstAnchors();
  for (const auto& [id, record] : records_) index(id, record);
}

std::uint32_t MapState::numberOf(const std::string& class_name) {
  return class_numbers_.try_emplace(class_name, class_numbers_.size()).first->second;
}

void MapState::add(const Anchor& anchor) {
  anchors_[anchor.id] = anchor;
  if (anchor.previous == 0) {
    const RigidTransform T_WM = levelled(RigidTransform(), anchor.T_WA.R().col(2));
    graph_.addFirst(anchor.id, levelOf(T_WM.inverse() * anchor.T_WA));
  } else {
    graph_.add(anchor.id, anchor.previous, anchor.from_previous);
  }
}

std::optional<Anchor> MapState::newestOf(const WorldId& session) const {
  for (auto it = anchors_.rbegin(); it != anchors_.rend(); ++it) {
    if (it->second.session == session) return it->second;
  }
  return std::nullopt;
}

void MapState::removeLoop(EdgeId id) { graph_.remove(id); }

void MapState::scaleOdometry(double factor, const WorldId& session) {
  std::set<AnchorId> of_session;
  for (auto& [id, anchor] : anchors_) {
    if (anchor.session != session) continue;
    anchor.from_previous.covariance *= factor;
    anchor.scale2 *= factor;
    of_session.insert(id);
  }
  graph_.scaleOdometry(factor, of_session);
}

void MapState::move(const std::set<AnchorId>& anchors, const LevelPose& T_MN) {
  for (const AnchorId id : anchors) graph_.setPose(id, T_MN * graph_.pose(id));
}

void MapState::index(ObjectId id, const ObjectRecord& record) {
  seen_from_[record.sighting.anchor].insert(id);
  if (record.earlier) seen_from_[record.earlier->anchor].insert(id);
}

void MapState::unindex(ObjectId id, const ObjectRecord& record) {
  seen_from_[record.sighting.anchor].erase(id);
  if (record.earlier) seen_from_[record.earlier->anchor].erase(id);
}

const std::set<ObjectId>& MapState::seenFrom(AnchorId id) const {
  static const std::set<ObjectId> kNone;
  const auto at = seen_from_.find(id);
  return at == seen_from_.end() ? kNone : at->second;
}

void MapState::put(ObjectId id, ObjectRecord record) {
  touched_.insert(id);
  const auto at = records_.find(id);
  if (at != records_.end()) unindex(id, at->second);
  index(id, record);
  if (record.confirmed) {
    unconfirmed_.erase(id);
  } else {
    unconfirmed_.insert(id);
  }
  records_.insert_or_assign(id, std::move(record));
}

void MapState::erase(ObjectId id) {
  const auto at = records_.find(id);
  if (at == records_.end()) return;
  if (at->second.confirmed) erased_.insert(id);
  touched_.erase(id);
  unconfirmed_.erase(id);
  unindex(id, at->second);
  records_.erase(at);
}

const View& MapState::viewFrom(AnchorId id) const {
  static const View kNone;
  const auto at = views_.find(id);
  return at == views_.end() ? kNone : at->second;
}

void MapState::putView(AnchorId id, View view) {
  if (view.empty()) return;
  views_.insert_or_assign(id, std::move(view));
  views_touched_.insert(id);
}

void MapState::putMerge(ObjectId absorbed, HungMerge merge) {
  merges_.insert_or_assign(absorbed, std::move(merge));
  merges_touched_.insert(absorbed);
  merges_erased_.erase(absorbed);
}

void MapState::eraseMerge(ObjectId absorbed) {
  if (merges_.erase(absorbed) == 0) return;
  merges_touched_.erase(absorbed);
  merges_erased_.insert(absorbed);
}

SavedAnchor MapState::savedAnchor(AnchorId id) const {
  return {anchors_.at(id), graph_.pose(id), graph_.isHeldFast(id)};
}

bool MapState::isSaved(AnchorId id) const {
  const auto at = saved_anchors_.find(id);
  if (at == saved_anchors_.end()) return false;
  const LevelPose& now = graph_.pose(id);
  return at->second.T_MA.p == now.p && at->second.T_MA.yaw == now.yaw &&
         at->second.scale2 == anchors_.at(id).scale2;
}

Unsaved MapState::unsaved() const {
  Unsaved result;
  result.changed.classes.resize(class_numbers_.size());
  for (const auto& [name, number] : class_numbers_) result.changed.classes[number] = name;
  for (const auto& [id, anchor] : anchors_) {
    if (!isSaved(id)) result.changed.anchors[id] = savedAnchor(id);
  }
  for (const auto& [id, edge] : graph_.edges()) {
    if (edge.kind == EdgeKind::kOdometry) continue;
    const auto at = saved_edges_.find(id);
    if (at == saved_edges_.end() || at->second != graph_.weight(id)) {
      result.changed.edges[id] = {edge, graph_.weight(id)};
    }
  }
  for (const auto& [id, weight] : saved_edges_) {
    if (!graph_.edges().contains(id)) result.edges_gone.insert(id);
  }
  for (const ObjectId id : touched_) {
    const ObjectRecord& record = records_.at(id);
    if (record.confirmed) result.changed.records[id] = record;
  }
  // One that was begun again under its id is gone until it is confirmed.
  for (const ObjectId id : erased_) {
    if (!result.changed.records.contains(id)) result.records_gone.insert(id);
  }
  for (const ObjectId id : merges_touched_) result.changed.merges[id] = merges_.at(id);
  result.merges_gone = merges_erased_;
  for (const AnchorId id : views_touched_) result.changed.views[id] = views_.at(id);
  return result;
}

void MapState::markSaved() {
  merges_touched_.clear();
  merges_erased_.clear();
  views_touched_.clear();
  for (const auto& [id, anchor] : anchors_) {
    saved_anchors_[id] = {graph_.pose(id), anchor.scale2};
  }
  saved_edges_.clear();
  for (const auto& [id, edge] : graph_.edges()) {
    if (edge.kind != EdgeKind::kOdometry) saved_edges_[id] = graph_.weight(id);
  }
  touched_.clear();
  erased_.clear();
}

}  // namespace perdure::mapping
