#include "common/mapping/map_state.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>
#include <vector>

namespace perdure::mapping {

MapState::MapState(const Parameters& parameters, SavedMap saved)
    : visit_m_(parameters.loop.visit_m),
      graph_(parameters.graph),
      records_(std::move(saved.records)),
      tracks_(std::move(saved.tracks)),
      identity_(saved.facts, std::move(saved.corrections)),
      saved_facts_(std::move(saved.facts)),
      views_(std::move(saved.views)) {
  for (std::size_t k = 0; k < saved.classes.size(); ++k) {
    class_numbers_[saved.classes[k]] = static_cast<std::uint32_t>(k);
  }
  // Loop closures come first, because their ids are stored; odometry edges get new ids.
  for (const auto& [id, edge] : saved.edges) {
    if (edge.edge.kind == EdgeKind::kOdometry) continue;
    graph_.restore(id, edge.edge, edge.weight);
    saved_edges_[id] = edge.weight;
  }
  for (const auto& [id, saved_anchor] : saved.anchors) {
    const Anchor& anchor = saved_anchor.anchor;
    add(anchor);
    graph_.setPose(id, saved_anchor.T_MA);
    saved_anchors_[id] = {saved_anchor.T_MA, anchor.scale};
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

void MapState::removeLoop(EdgeId id) {
  graph_.remove(id);
  endFactsOf(id);
}

void MapState::scaleOdometry(const DriftVariance& scale, const WorldId& session) {
  std::map<AnchorId, DriftVariance> factors;
  for (auto& [id, anchor] : anchors_) {
    if (anchor.session != session || anchor.scale == scale) continue;
    const DriftVariance factor = scale.over(anchor.scale);
    anchor.from_previous.covariance = factor.of(anchor.from_previous.covariance);
    anchor.scale = scale;
    factors.emplace(id, factor);
  }
  graph_.scaleOdometry(factors);
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

void MapState::putObject(ObjectId id, ObjectRecord record) {
  touched_.insert(id);
  const auto at = records_.find(id);
  if (at != records_.end()) unindex(id, at->second);
  index(id, record);
  if (record.confirmed) {
    unconfirmed_.erase(id);
  } else {
    unconfirmed_.insert(id);
    if (at != records_.end() && at->second.confirmed) erased_.insert(id);
  }
  records_.insert_or_assign(id, std::move(record));
}

void MapState::eraseObject(ObjectId id) {
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

const ObjectRecord* MapState::recordOfTrack(TrackId id) const {
  const auto& all = identity_.isShared(id) ? tracks_ : records_;
  const auto at = all.find(id);
  return at == all.end() ? nullptr : &at->second;
}

void MapState::put(TrackId id, ObjectRecord record) {
  record.sighting.in_anchor.id = id;
  if (record.earlier) record.earlier->in_anchor.id = id;
  if (!identity_.isShared(id)) return putObject(id, std::move(record));
  tracks_.insert_or_assign(id, std::move(record));
  tracks_touched_.insert(id);
  tracks_erased_.erase(id);
  combine(identity_.objectOf(id));
}

void MapState::end(TrackId id) {
  if (!identity_.isShared(id)) return eraseObject(id);
  const auto at = tracks_.find(id);
  if (at == tracks_.end()) return;
  at->second.gone = true;
  tracks_touched_.insert(id);
  combine(identity_.objectOf(id));
}

void MapState::erase(TrackId id) {
  if (!identity_.isShared(id)) return eraseObject(id);
  if (tracks_.erase(id) == 0) return;
  tracks_touched_.erase(id);
  tracks_erased_.insert(id);
  combine(identity_.objectOf(id));
}

/// Between two other sessions, compares anchors: their ids increase, but the clocks of two sessions
/// may differ.
bool MapState::isNewer(const ObjectRecord& a, const ObjectRecord& b) const {
  if (a.session == b.session) return a.last_seen >= b.last_seen;
  if (a.session == session_ || b.session == session_) return a.session == session_;
  return a.sighting.anchor > b.sighting.anchor;
}

/// Returns the record of an object from those of its tracks. Its newest track determines its
/// position, and whether it exists. `earlier` is the newest sighting of another visit.
std::optional<ObjectRecord> MapState::combined(ObjectId object) const {
  std::vector<const ObjectRecord*> records;
  bool confirmed = false;
  for (const TrackId track : identity_.tracksOf(object)) {
    const auto at = tracks_.find(track);
    if (at == tracks_.end()) continue;
    confirmed = confirmed || at->second.confirmed;
    const auto older = std::find_if(records.begin(), records.end(),
                                    [&](const ObjectRecord* r) { return isNewer(at->second, *r); });
    records.insert(older, &at->second);
  }
  if (records.empty() || records.front()->gone) return std::nullopt;
  const ObjectRecord& newest = *records.front();
  ObjectRecord result = newest;
  result.confirmed = confirmed;
  for (const ObjectRecord* record : records) {
    if (result.earlier) break;
    if (record->gone) continue;
    const bool another_visit =
        record->session != newest.session || std::abs(record->way_m - newest.way_m) > visit_m_;
    result.earlier = another_visit ? record->sighting : record->earlier;
  }
  return result;
}

void MapState::combine(ObjectId object) {
  auto record = combined(object);
  record ? putObject(object, *std::move(record)) : eraseObject(object);
}

void MapState::unite(const SameObject& fact) {
  Groups before = groupsOf(fact.a, fact.b);
  identity_.add(fact);
  regroup(std::move(before));
}

void MapState::put(const Correction& correction) {
  unsaved_corrections_.push_back(correction);
  std::vector<Correction> all = identity_.corrections();
  const auto at = std::ranges::lower_bound(all, correction.id, {}, &Correction::id);
  if (at != all.end() && at->id == correction.id) {
    *at = correction;
  } else {
    all.insert(at, correction);
  }
  Groups before;
  if (correction.aboutTwo()) before = groupsOf(correction.object, correction.other);
  identity_.setCorrections(std::move(all));
  regroup(std::move(before));
}

void MapState::endFactsOf(EdgeId loop) {
  Groups before;
  for (const SameObject& fact : identity_.factsOf(loop)) before.merge(groupsOf(fact.a, fact.b));
  identity_.endLoop(loop);
  regroup(std::move(before));
}

/// Returns the objects of all tracks whose objects may change with those of a and b.
MapState::Groups MapState::groupsOf(TrackId a, TrackId b) const {
  Groups groups;
  for (const TrackId track : identity_.reachOf(a, b)) groups[track] = identity_.objectOf(track);
  return groups;
}

/// Moves the records of tracks that begin or cease to share an object. `before`: their objects
/// before the change of the facts.
void MapState::regroup(Groups before) {
  std::map<ObjectId, std::size_t> sizes;
  for (const auto& [track, object] : before) ++sizes[object];
  std::erase_if(before, [&](const auto& each) {  // alone before and after
    return sizes.at(each.second) == 1 && !identity_.isShared(each.first);
  });
  std::set<ObjectId> objects;
  for (const auto& [track, object] : before) objects.insert({object, identity_.objectOf(track)});
  for (const auto& [track, object] : before) {
    const bool was_shared = sizes.at(object) > 1, is_shared = identity_.isShared(track);
    if (was_shared != is_shared || identity_.objectOf(track) != object) regrouped_.insert(track);
    const auto alone = records_.find(track);
    if (was_shared || !is_shared || alone == records_.end()) continue;
    tracks_[track] = alone->second;
    tracks_touched_.insert(track);
    tracks_erased_.erase(track);
  }
  for (const ObjectId object : objects) {
    identity_.tracksOf(object).empty() ? eraseObject(object) : combine(object);
  }
  for (const auto& [track, object] : before) {
    if (identity_.isShared(track)) continue;
    auto record = tracks_.extract(track);
    if (record.empty()) continue;
    tracks_touched_.erase(track);
    tracks_erased_.insert(track);
    if (!record.mapped().gone) putObject(track, std::move(record.mapped()));
  }
}

SavedAnchor MapState::savedAnchor(AnchorId id) const {
  return {anchors_.at(id), graph_.pose(id), graph_.isHeldFast(id)};
}

bool MapState::isSaved(AnchorId id) const {
  const auto at = saved_anchors_.find(id);
  if (at == saved_anchors_.end()) return false;
  const LevelPose& now = graph_.pose(id);
  return at->second.T_MA.p == now.p && at->second.T_MA.yaw == now.yaw &&
         at->second.scale == anchors_.at(id).scale;
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
  // If a new object has the id of an erased one, the stored record is removed until it is
  // confirmed.
  for (const ObjectId id : erased_) {
    if (!result.changed.records.contains(id)) result.records_gone.insert(id);
  }
  for (const TrackId id : tracks_touched_) result.changed.tracks[id] = tracks_.at(id);
  result.tracks_gone = tracks_erased_;
  const std::set<SameObject>& facts = identity_.facts();
  std::set_difference(facts.begin(), facts.end(), saved_facts_.begin(), saved_facts_.end(),
                      std::inserter(result.changed.facts, result.changed.facts.end()));
  std::set_difference(saved_facts_.begin(), saved_facts_.end(), facts.begin(), facts.end(),
                      std::inserter(result.facts_gone, result.facts_gone.end()));
  result.changed.corrections = unsaved_corrections_;
  for (const AnchorId id : views_touched_) result.changed.views[id] = views_.at(id);
  return result;
}

void MapState::markSaved() {
  tracks_touched_.clear();
  tracks_erased_.clear();
  regrouped_.clear();
  saved_facts_ = identity_.facts();
  unsaved_corrections_.clear();
  views_touched_.clear();
  for (const auto& [id, anchor] : anchors_) {
    saved_anchors_[id] = {graph_.pose(id), anchor.scale};
  }
  saved_edges_.clear();
  for (const auto& [id, edge] : graph_.edges()) {
    if (edge.kind != EdgeKind::kOdometry) saved_edges_[id] = graph_.weight(id);
  }
  touched_.clear();
  erased_.clear();
}

}  // namespace perdure::mapping
