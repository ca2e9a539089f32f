#include "common/mapping/fusion/united_sessions.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "common/mapping/graph/components.h"
#include "common/mapping/map_state.h"

namespace perdure::mapping {
namespace {

std::map<AnchorId, AnchorId> componentsIn(const SavedMap& map) {
  return componentsOf(MapState(Parameters(), map).graph());
}

bool isSameAnchor(const Anchor& a, const Anchor& b) {
  return a.stamp.sameFrame(b.stamp) && a.stamp.time == b.stamp.time && a.T_WA.p == b.T_WA.p;
}

}  // namespace

UnitedSessions::UnitedSessions(MapContents& map, const MapContents& other, Addition& addition)
    : map_(map),
      other_(other),
      addition_(addition),
      sessions_(sessionsOf(map.graph)),
      other_sessions_(sessionsOf(other.graph)) {
  for (const Session& session : sessions_) worlds_.insert(session.world);
  for (const auto& [id, object] : map.objects) worlds_.insert(object.world);
  for (const WorldId& world : worlds_) numbers_.insert(world.world);
  matchWorlds();
  matchAnchors();
  makeRoom();
  addAnchors();
  addEdges();
  addClasses();
}

WorldId UnitedSessions::freeWorld(const WorldId& world) const {
  const auto told = number_of_.find(world.world);
  if (told != number_of_.end() && !worlds_.contains({told->second, world.epoch})) {
    return {told->second, world.epoch};
  }
  std::uint64_t number = world.world;
  if (numbers_.contains(number)) {
    for (number = 1; numbers_.contains(number);) ++number;
  }
  return {number, world.epoch};
}
const WorldId& UnitedSessions::worldOf(const WorldId& world) {
  const auto known = world_of_.find(world);
  if (known != world_of_.end()) return known->second;
  const WorldId chosen = freeWorld(world);
  number_of_.try_emplace(world.world, chosen.world);
  worlds_.insert(chosen);
  numbers_.insert(chosen.world);
  return world_of_[world] = chosen;
}
void UnitedSessions::matchWorlds() {
  for (const Session& session : other_sessions_) {
    const Session* same = find(sessions_, session.identity);
    if (same == nullptr) continue;
    known_[session.world] = same;
    world_of_[session.world] = same->world;
    number_of_.try_emplace(session.world.world, same->world.world);
  }
}
void UnitedSessions::matchAnchors() {
  for (const Session& session : other_sessions_) {
    const auto known = known_.find(session.world);
    if (known == known_.end()) {
      (void)worldOf(session.world);
      addition_.sessions.push_back(world_of_.at(session.world));
      new_anchors_[session.world] = session.anchors;
    } else {
      matchAnchors(session, *known->second);
    }
  }
}

void UnitedSessions::matchAnchors(const Session& session, const Session& same) {
  const std::size_t both = std::min(session.anchors.size(), same.anchors.size());
  std::size_t alike = 0;
  while (alike < both && isSameAnchor(map_.graph.anchors.at(same.anchors[alike]).anchor,
                                      other_.graph.anchors.at(session.anchors[alike]).anchor)) {
    anchor_of_[session.anchors[alike]] = same.anchors[alike];
    ++alike;
  }
  const auto rest = session.anchors.begin() + static_cast<std::ptrdiff_t>(alike);
  if (rest == session.anchors.end()) {
    ++addition_.known;
  } else if (alike < same.anchors.size()) {
    addition_.parted.push_back(same.world);
  } else {
    addition_.grown.push_back(same.world);
    new_anchors_[session.world] = {rest, session.anchors.end()};
  }
}

/// Reserves ids for new anchors. Those of a session are consecutive, so the ids of all later
/// anchors increase if a session continues.
void UnitedSessions::makeRoom() {
  if (!addition_.grown.empty()) moveUp();
  AnchorId next = map_.graph.anchors.empty() ? 1 : map_.graph.anchors.rbegin()->first + 1;
  for (const auto& [world, first] : first_new_) {
    next = std::max(next, first + new_anchors_.at(otherWorld(world)).size());
  }
  for (const WorldId& world : addition_.sessions) {
    first_new_[world] = next;
    next += new_anchors_.at(otherWorld(world)).size();
  }
  frames_ = componentsIn(map_.graph);
}

void UnitedSessions::moveUp() {
  std::map<WorldId, std::size_t> more;
  for (const auto& [world, anchors] : new_anchors_) more[world_of_.at(world)] = anchors.size();
  std::map<AnchorId, AnchorId> moved;
  AnchorId next = 1;
  for (const Session& session : sessions_) {
    for (const AnchorId id : session.anchors) moved[id] = next++;
    if (!more.contains(session.world)) continue;
    first_new_[session.world] = next;
    next += more.at(session.world);
  }
  renumber(moved);
}

WorldId UnitedSessions::otherWorld(const WorldId& world) const {
  for (const auto& [theirs, ours] : world_of_) {
    if (ours == world && new_anchors_.contains(theirs)) return theirs;
  }
  return {};
}

void UnitedSessions::renumber(const std::map<AnchorId, AnchorId>& moved) {
  const auto now = [&](AnchorId id) { return id == 0 ? 0 : moved.at(id); };
  std::map<AnchorId, SavedAnchor> anchors;
  for (auto& [id, saved] : map_.graph.anchors) {
    saved.anchor.id = now(id);
    saved.anchor.previous = now(saved.anchor.previous);
    anchors[now(id)] = saved;
  }
  map_.graph.anchors = std::move(anchors);
  for (auto& [id, saved] : map_.graph.edges) {
    saved.edge.a = now(saved.edge.a);
    saved.edge.b = now(saved.edge.b);
  }
  for (auto& [id, record] : map_.graph.records) {
    record.sighting.anchor = now(record.sighting.anchor);
    if (record.earlier) record.earlier->anchor = now(record.earlier->anchor);
  }
  std::map<AnchorId, View> views;
  for (auto& [id, view] : map_.graph.views) views[now(id)] = std::move(view);
  map_.graph.views = std::move(views);
  for (auto& [theirs, ours] : anchor_of_) ours = now(ours);
}

void UnitedSessions::addAnchors() {
  const auto components = componentsIn(other_.graph);
  const std::map<AnchorId, AnchorId> known = anchor_of_;
  for (const auto& [world, anchors] : new_anchors_) {
    AnchorId next = first_new_.at(world_of_.at(world));
    for (const AnchorId id : anchors) {
      anchor_of_[id] = next;
      addAnchor(id, next++, reference(id, known, components), components.at(id));
    }
  }
}

/// Returns the id in the other map of the nearest known anchor of the same component; 0 if there is
/// none.
AnchorId UnitedSessions::reference(AnchorId id, const std::map<AnchorId, AnchorId>& known,
                                   const std::map<AnchorId, AnchorId>& components) const {
  const Eigen::Vector3d& p = other_.graph.anchors.at(id).T_MA.p;
  AnchorId nearest = 0;
  double nearest_m = std::numeric_limits<double>::infinity();
  for (const auto& [theirs, ours] : known) {
    if (components.at(theirs) != components.at(id)) continue;
    const double distance = (other_.graph.anchors.at(theirs).T_MA.p - p).norm();
    if (distance >= nearest_m) continue;
    nearest_m = distance;
    nearest = theirs;
  }
  return nearest;
}

void UnitedSessions::addAnchor(AnchorId theirs, AnchorId id, AnchorId reference,
                               AnchorId component) {
  SavedAnchor saved = other_.graph.anchors.at(theirs);
  saved.anchor.id = id;
  saved.anchor.session = world_of_.at(saved.anchor.session);
  if (saved.anchor.previous != 0) saved.anchor.previous = anchor_of_.at(saved.anchor.previous);
  if (reference != 0) {
    const AnchorId ours = anchor_of_.at(reference);
    saved.T_MA = map_.graph.anchors.at(ours).T_MA *
                 other_.graph.anchors.at(reference).T_MA.inverse() * saved.T_MA;
    saved.held_fast = false;
    frames_[id] = frames_.at(ours);
  } else {
    const auto first = first_of_.try_emplace(component, id).first;
    frames_[id] = first->second;
  }
  map_.graph.anchors[id] = std::move(saved);
  const auto view = other_.graph.views.find(theirs);
  if (view != other_.graph.views.end()) map_.graph.views[id] = view->second;
  new_ids_.insert(id);
}

/// Adds the edges of new anchors. Leaves out an edge between components that are not linked yet,
/// because the search finds that loop again and moves the components.
void UnitedSessions::addEdges() {
  EdgeId next = map_.graph.edges.empty() ? 1 : map_.graph.edges.rbegin()->first + 1;
  for (const auto& [id, theirs] : other_.graph.edges) {
    const auto a = anchor_of_.find(theirs.edge.a), b = anchor_of_.find(theirs.edge.b);
    if (a == anchor_of_.end() || b == anchor_of_.end()) continue;
    if (!new_ids_.contains(a->second) && !new_ids_.contains(b->second)) continue;
    if (frames_.at(a->second) != frames_.at(b->second)) continue;
    SavedEdge saved = theirs;
    saved.edge.a = a->second;
    saved.edge.b = b->second;
    map_.graph.edges[next++] = saved;
  }
}
void UnitedSessions::addClasses() {
  auto& names = map_.graph.classes;
  for (const std::string& name : other_.graph.classes) {
    auto at = std::find(names.begin(), names.end(), name);
    if (at == names.end()) at = names.insert(at, name);
    class_of_.push_back(static_cast<std::uint32_t>(at - names.begin()));
  }
}

bool UnitedSessions::take(Sighting& sighting, ObjectId id) const {
  const auto anchor = anchor_of_.find(sighting.anchor);
  if (anchor == anchor_of_.end()) return false;
  sighting.anchor = anchor->second;
  sighting.in_anchor.id = id;
  for (ClassShare& share : sighting.in_anchor.pmf) share.name = class_of_.at(share.name);
  return true;
}

std::optional<ObjectRecord> UnitedSessions::recordOf(ObjectId theirs, ObjectId id) const {
  const auto at = other_.graph.records.find(theirs);
  if (at == other_.graph.records.end()) return std::nullopt;
  ObjectRecord record = at->second;
  if (!take(record.sighting, id)) return std::nullopt;
  record.session = map_.graph.anchors.at(record.sighting.anchor).anchor.session;
  if (record.earlier && !take(*record.earlier, id)) record.earlier.reset();
  return record;
}

bool UnitedSessions::wasSeenInBoth(const ObjectRecord& record) const {
  const auto both = [&](const Sighting& sighting) {
    const WorldId& world = map_.graph.anchors.at(sighting.anchor).anchor.session;
    return std::any_of(known_.begin(), known_.end(),
                       [&](const auto& each) { return each.second->world == world; });
  };
  return both(record.sighting) || (record.earlier && both(*record.earlier));
}

}  // namespace perdure::mapping
