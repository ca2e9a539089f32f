// Exchange of tracks between the working set and the map.
#include <algorithm>
#include <set>
#include <utility>

#include "services/semantic_filter/node.h"

namespace perdure::semantic_filter {
namespace {

bool isMalformed(const ObjectBelief& belief) { return belief.classes.empty() || belief.id == 0; }

}  // namespace

/// Removes tracks that are archived or forgotten. They leave all frames that may be stepped again,
/// so late detections cannot bring them back.
void Node::letGo(const Frame& frame) {
  const TimePoint now = frame.input.stamp.time, oldest = history_.oldestTime();
  const auto leaving =
      archive_.leaving(history_.belief().tracks, frame.input.view.T_WB.p, now, oldest);
  if (leaving.archived.empty() && leaving.forgotten.empty()) return;
  std::set<TrackId> ids(leaving.archived.begin(), leaving.archived.end());
  for (const Track& o : history_.belief().tracks) {
    if (!ids.contains(o.id)) continue;
    archive_.rememberReference(o);
    events_.archived(o.id);
  }
  ids.insert(leaving.forgotten.begin(), leaving.forgotten.end());
  history_.erase(ids);
}

/// Returns the tracks of a message. New tracks will not get their ids.
Arrivals Node::arrivalsOf(const MapNear& near, ExistenceEvidence evidence) {
  Arrivals arrivals;
  arrivals.evidence = evidence;
  for (const Member& member : near.members) arrivals.members[member.track] = member.object;
  const auto isSound = [&](const ObjectBelief& belief) {
    if (isMalformed(belief)) {
      reasons_.add("near_malformed");
      return false;
    }
    history_.ids().atLeast(std::max(belief.id, belief.trackId()) + 1);
    events_.recalled(belief.trackId(), evidence == ExistenceEvidence::kRestore);
    return true;
  };
  for (const ObjectBelief& belief : near.placed) {
    if (isSound(belief)) arrivals.placed.push_back(belief);
  }
  for (ObjectBelief belief : near.as_published) {
    if (!isSound(belief)) continue;
    if (const auto product = archive_.referenceAt(belief.as_of)) {
      arrivals.as_published.push_back({std::move(belief), *product});
      continue;
    }
    // The covariance includes an earlier pose error, whose correlation with the present one is not
    // known.
    for (ClassBelief& c : belief.classes) c.cross_pose.setZero();
    arrivals.as_published.push_back({std::move(belief), history_.poseError().product});
  }
  return arrivals;
}

void Node::onNear(const MapNear& near) {
  if (near.client != instance_) return;
  history_.ids().atLeast(near.next_id);
  if (near.instance == near_source_ && near.revision <= near_revision_) {
    return reasons_.add("near_repeated");
  }
  if (!world_) {
    waiting_near_ = near;
    return;
  }
  if (near.world != *world_) return reasons_.add("near_of_other_world");
  take(near, ExistenceEvidence::kRecall);
}

/// Uses a message for the next frame. If another one arrives before that frame, it is used instead.
void Node::take(const MapNear& near, ExistenceEvidence evidence) {
  near_source_ = near.instance;
  near_revision_ = near.revision;
  archive_.onKept(near.kept);
  while (!ended_.empty() && ended_.front().time <= near.kept) dropOldestEnded();
  const auto arrivals = std::make_shared<const Arrivals>(arrivalsOf(near, evidence));
  members_ = arrivals->members;
  corrections_.take(near.corrections);
  for (const EndedTrack& each : ended_) {  // the map may not have received these
    if (ended_confirmed_.contains(each.track)) noteMerge(each.into, each.track);
  }
  history_.arrive(arrivals);
}

/// Assigns the survivor of a merge of confirmed tracks to the older object, as the map does.
void Node::noteMerge(TrackId survivor, TrackId absorbed) {
  const auto memberOf = [&](TrackId track) {
    const auto at = members_.find(track);
    return at == members_.end() ? track : at->second;
  };
  const ObjectId object = std::min(memberOf(survivor), memberOf(absorbed));
  if (object != survivor) members_[survivor] = object;
}

/// Assigns object ids to tracks. If an object has two tracks, the track with the same id has the
/// object id, or else the first track.
void Node::nameObjects() {
  object_of_.clear();
  track_of_.clear();
  const std::vector<Track>& tracks = history_.belief().tracks;
  for (const Track& track : tracks) {
    const auto member = members_.find(track.id);
    if (member == members_.end() || track_of_.contains(member->second)) continue;
    const bool taken = std::any_of(tracks.begin(), tracks.end(),
                                   [&](const Track& t) { return t.id == member->second; });
    if (taken) continue;
    object_of_[track.id] = member->second;
    track_of_[member->second] = track.id;
  }
}

ObjectId Node::objectOf(TrackId track) const {
  const auto at = object_of_.find(track);
  return at == object_of_.end() ? track : at->second;
}

TrackId Node::trackOf(ObjectId object) const {
  const auto at = track_of_.find(object);
  return at == track_of_.end() ? object : at->second;
}

void Node::keepEnded(const std::vector<EndedTrack>& ended) {
  ended_.insert(ended_.end(), ended.begin(), ended.end());
  while (ended_.size() > kMostEnded) dropOldestEnded();
}

void Node::dropOldestEnded() {
  ended_confirmed_.erase(ended_.front().track);
  ended_.pop_front();
}

}  // namespace perdure::semantic_filter
