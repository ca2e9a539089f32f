// The node's functions for `map/near`: the objects near the body, for the filter.
#include <algorithm>
#include <utility>

#include "common/mapping/frames/laid_belief.h"
#include "services/map_store/node.h"

namespace perdure::map_store {
namespace {

/// Limits the times of a belief to `now`, because the clocks of two sessions cannot be compared.
ObjectBelief notLaterThan(TimePoint now, ObjectBelief belief) {
  belief.last_seen = std::min(belief.last_seen, now);
  belief.first_seen = std::min(belief.first_seen, belief.last_seen);
  belief.as_of = std::min(belief.as_of, now);
  return belief;
}

std::uint64_t digestOf(const std::vector<ObjectBelief>& beliefs) {
  std::string bytes;
  for (const ObjectBelief& belief : beliefs) {
    const Bytes each = encodeBelief(belief);
    bytes.append(each.begin(), each.end());
  }
  return digest(bytes);
}

/// Compares the messages without stamp, revision and next id.
bool sameContent(const MapNear& a, const MapNear& b) {
  return a.client == b.client && a.world == b.world && a.kept == b.kept &&
         a.corrects_drift == b.corrects_drift && a.more == b.more && a.members == b.members &&
         a.corrections == b.corrections && digestOf(a.placed) == digestOf(b.placed) &&
         digestOf(a.as_published) == digestOf(b.as_published);
}

}  // namespace

MapNear Node::blankNear(InstanceId client, const WorldId& world) const {
  MapNear near;
  if (newest_) near.stamp = newest_->stamp;
  near.instance = instance_;
  near.client = client;
  near.world = world;
  near.next_id = next_id_;
  if (kept_of_ == client) near.kept = kept_;
  return near;
}

void Node::sendNear() {
  if (!newest_) return;
  near_from_W_ = newest_->T_WB.p;
  publish(nearNow());
}

/// Adds the object ids, and sends the message unless its content equals that of the last one.
void Node::publish(MapNear near) {
  const mapping::Identity& identity = mapper_.identity();
  const auto addMember = [&](TrackId track) {
    if (identity.observedObjectOf(track) != track)
      near.members.push_back({track, identity.observedObjectOf(track)});
  };
  if (newest_ && newest_->instance == near.client) {
    for (const ObjectBelief& belief : newest_->objects) addMember(belief.id);
  }
  for (auto* list : {&near.placed, &near.as_published}) {
    for (ObjectBelief& belief : *list) {
      belief.track = belief.id;
      belief.id = identity.observedObjectOf(belief.track);
      addMember(belief.track);
    }
  }
  addCorrections(near);
  if (near_ && sameContent(near, *near_)) return;
  near.revision = ++near_revision_;
  for (const ObjectBelief& belief : near.placed) {
    placed_[belief.track] = {mapper_.revision(), near.revision};
    const auto join = joins_.find(belief.track);
    if (join != joins_.end() && join->second.near == 0) join->second.near = near.revision;
  }
  outputs_.near(near);
  near_ = std::move(near);
}

MapNear Node::nearNow() {
  MapNear near = blankNear(newest_->instance, newest_->world);
  near.corrects_drift = graph_ && mapper_.follows(newest_->world);
  if (newest_->near_m > 0.0) near.corrects_drift ? putNearByGraph(near) : putNearAsStored(near);
  const auto most = static_cast<std::size_t>(config_.query_limit);
  const auto distance_m = [&](const ObjectBelief& belief) {
    return (belief.best().mean.head<3>() - newest_->T_WB.p).norm();
  };
  for (auto* list : {&near.placed, &near.as_published}) {
    if (list->size() <= most) continue;
    near.more = true;
    std::stable_sort(list->begin(), list->end(),
                     [&](const auto& a, const auto& b) { return distance_m(a) < distance_m(b); });
    list->resize(most);
  }
  return near;
}

/// Adds near objects that are not in the working set, recalled ones that the graph has moved since,
/// and known tracks that a loop identified with objects of the working set.
void Node::putNearByGraph(MapNear& near) {
  std::map<TrackId, bool> working;  // value: ObjectBelief::recalled
  std::set<ObjectId> present;
  for (const ObjectBelief& belief : newest_->objects) {
    working[belief.id] = belief.recalled;
    present.insert(mapper_.identity().objectOf(belief.id));
  }
  const bool heard = newest_->near_source == instance_;
  const auto isTaken = [&](std::uint64_t revision) {
    return revision > 0 && heard && newest_->near_revision >= revision;
  };
  for (const mapping::Recallable& there : mapper_.near(newest_->T_WB.p, newest_->near_m)) {
    const auto in = working.find(there.track);
    if (in == working.end() && present.contains(there.id)) continue;
    if (in != working.end()) {
      const auto given = placed_.find(there.track);
      if (!in->second || given == placed_.end() || !there.T_now) continue;
      if (given->second.graph == mapper_.revision() && isTaken(given->second.near)) continue;
    }
    give(there, near);
  }
  std::erase_if(joins_, [&](const auto& join) {
    return isTaken(join.second.near) || working.contains(join.first) ||
           !working.contains(join.second.seen);
  });
  for (const auto& [known, join] : joins_) {
    if (const auto there = mapper_.placeOf(known)) give(*there, near);
  }
}

/// Adds near objects of W as stored, because there is no graph that receives this odometry.
void Node::putNearAsStored(MapNear& near) {
  std::set<ObjectId> present;
  for (const ObjectBelief& belief : newest_->objects) {
    present.insert(mapper_.identity().objectOf(belief.id));
  }
  // The nearest objects may all be in the working set, so the limit is increased.
  const auto limit = static_cast<std::uint32_t>(config_.query_limit + present.size());
  auto found =
      database_.reader().inFullNear(newest_->T_WB.p, newest_->near_m, newest_->world, limit);
  if (!found) return blame(found.error());
  if (found->malformed > 0) reasons_.add("belief_malformed", found->malformed);
  near.more = found->truncated;
  for (ObjectBelief& belief : found->beliefs) {
    if (present.contains(belief.id) || removed_.contains(belief.id) || belief.moving > 0.5)
      continue;
    if (belief.last_seen >= client_since_) {
      near.as_published.push_back(std::move(belief));
      continue;
    }
    for (ClassBelief& c : belief.classes) c.cross_pose.setZero();
    near.placed.push_back(notLaterThan(newest_->stamp.time, std::move(belief)));
  }
}

void Node::give(const mapping::Recallable& there, MapNear& near) {
  auto stored = database_.reader().beliefOf(there.track);
  if (!stored) return blame(stored.error());
  if (!*stored || (*stored)->belief.moving > 0.5 || removed_.contains(there.track)) return;
  ObjectBelief belief = std::move((*stored)->belief);
  belief.id = there.track;
  if (!there.T_now && belief.last_seen >= client_since_) {
    near.as_published.push_back(std::move(belief));
    return;
  }
  belief = mapping::relativeToBody(std::move(belief), there.pose_error);
  if (there.T_now) belief = mapping::turned(*there.T_now, std::move(belief));
  belief = mapping::withFrameError(std::move(belief), there.covariance, there.about_W);
  near.placed.push_back(notLaterThan(newest_->stamp.time, std::move(belief)));
}

const Objects* Node::workingSetFor(const MapQuery& query) const {
  // If the querying filter has published already, its predecessor's working set is required.
  const auto& set = newest_ && newest_->instance == query.client ? previous_ : newest_;
  if (!set || (query.world.world != 0 && query.world != set->world)) return nullptr;
  return &*set;
}

/// Sends the whole working set of another filter, including unconfirmed and moving tracks. It is
/// relative to the body, because the pose error of the new process begins at zero.
void Node::restore(const MapQuery& query) {
  MapNear near = blankNear(query.client, query.world);
  if (const Objects* set = workingSetFor(query)) {
    near.world = set->world;
    for (const auto& belief : set->objects) {
      if (removed_.contains(belief.id)) continue;
      near.placed.push_back(mapping::relativeToBody(belief, set->pose_error));
    }
  }
  reasons_.add("restores");
  near_.reset();  // so that publish() sends the answer even if it is unchanged
  publish(std::move(near));
}

}  // namespace perdure::map_store
