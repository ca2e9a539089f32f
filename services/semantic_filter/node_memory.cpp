// What leaves the working set of the node for the map, and what comes back from there.
#include <algorithm>
#include <set>

#include "services/semantic_filter/core/belief/pose_correlation.h"
#include "services/semantic_filter/core/belief/track_message.h"
#include "services/semantic_filter/node.h"

namespace perdure::semantic_filter {
namespace {

constexpr std::uint32_t kMostRecalled = 1000;  // by one answer

}  // namespace

/// What leaves was seen in no frame that may be stepped again, and leaves those too: a late
/// detection does not bring it back.
void Node::letGo(const Frame& frame) {
  const TimePoint now = frame.input.stamp.time, oldest = history_.oldestTime();
  const auto leaving =
      archive_.leaving(history_.belief().tracks, frame.input.view.T_WB.p, now, oldest);
  if (leaving.archived.empty() && leaving.forgotten.empty()) return;
  std::set<ObjectId> ids(leaving.archived.begin(), leaving.archived.end());
  for (const Track& o : history_.belief().tracks) {
    if (!ids.contains(o.id)) continue;
    archive_.rememberReference(o);
    events_.archived(o.id);
  }
  ids.insert(leaving.forgotten.begin(), leaving.forgotten.end());
  history_.erase(ids);
}

void Node::askTheMap(const Frame& frame) {
  if (!outputs_.queries) return;
  const Eigen::Vector3d& p_WB = frame.input.view.T_WB.p;
  const TimePoint now = frame.input.stamp.time;
  if (const auto question = archive_.ask(p_WB, now)) {
    ask(*question, frame.world);
  }
  const auto silent = archive_.takeUnanswered();
  if (silent > 0) reasons_.add("map_store_silent", silent);
}

void Node::ask(const Archive::Question& question, const WorldId& world) {
  MapQuery query;
  query.client = instance_;
  query.request = question.request;
  query.kind = MapQueryKind::kRecall;
  query.low = question.centre_W;
  query.radius = question.radius_m;
  query.world = world;
  query.limit = kMostRecalled;
  outputs_.queries(query);
}

void Node::restore(const ObjectBelief& belief) {
  history_.insert(fromBelief(belief, history_.poseError().product, ExistenceEvidence::kRestore));
  events_.recalled(belief.id, true);
}

void Node::recall(const ObjectBelief& belief) {
  if (belief.moving > 0.5) return reasons_.add("recalled_moving");
  const auto reference = archive_.referenceAt(belief.as_of);
  if (!isNear(belief)) return;
  Track object = fromBelief(belief, reference ? *reference : history_.poseError().product,
                            ExistenceEvidence::kRecall);
  if (!reference) {  // of another run: how its error hangs together with this one's is not known
    for (auto& h : object.hypotheses) h.C.setZero();
  }
  history_.insert(object);
  events_.recalled(belief.id, false);
}

bool Node::isNear(const ObjectBelief& belief) const {
  return !history_.lastPose() ||
         archive_.near(belief.best().mean.head<3>(), history_.lastPose()->p);
}

/// What can be used of it; no id of it is given out again.
std::vector<ObjectBelief> Node::soundOf(std::vector<ObjectBelief> beliefs) {
  const auto malformed =
      std::erase_if(beliefs, [](const ObjectBelief& b) { return b.classes.empty() || b.id == 0; });
  if (malformed > 0) reasons_.add("recalled_malformed", malformed);
  for (ObjectBelief& belief : beliefs) {
    history_.ids().atLeast(belief.id + 1);
  }
  return beliefs;
}

void Node::insertRecalled(const Recalled& recalled) {
  for (const ObjectBelief& belief : soundOf(recalled.objects)) {
    const auto same = [&](const Track& o) { return o.id == belief.id; };
    if (std::any_of(history_.belief().tracks.begin(), history_.belief().tracks.end(), same))
      continue;
    recalled.restore ? restore(belief) : recall(belief);
  }
}

/// What the map's graph has laid beside the body, and which of it is one with what was taken for
/// new.
void Node::insertLaid(const Recalled& recalled) {
  if (history_.empty()) return;
  const FrameInput& input = history_.newest().input;
  for (const MergeOrder& split : recalled.splits) {
    if (history_.split(split.survivor, split.absorbed)) {
      events_.renamed(split.survivor, split.absorbed);
    }
  }
  for (const ObjectBelief& belief : soundOf(recalled.objects)) {
    if (belief.moving > 0.5) {
      reasons_.add("recalled_moving");
      continue;
    }
    const auto same = [&](const Track& o) { return o.id == belief.id; };
    const std::vector<Track>& tracks = history_.belief().tracks;
    const auto there = std::find_if(tracks.begin(), tracks.end(), same);
    const bool again = there != tracks.end();
    // What was seen since is better known than by the graph.
    if (again ? !there->life.recalled : !isNear(belief)) continue;
    if (again) history_.erase({belief.id});
    Track track = fromBelief(belief, history_.poseError().product, ExistenceEvidence::kRecall);
    for (Hypothesis& h : track.hypotheses) {
      addPoseError(h, input.view.T_WB, input.view.up_W, history_.poseError().covariance);
    }
    history_.insert(track);
    if (!again) events_.recalled(belief.id, false);
  }
  for (const MergeOrder& merge : recalled.merges) {
    history_.join(merge.survivor, merge.absorbed, input);
  }
}

void Node::onRecalled(const Recalled& recalled) {
  const bool for_all = recalled.client == 0 && !recalled.restore;
  if (recalled.client != instance_ && !for_all) return;
  history_.ids().atLeast(recalled.next_id);
  if (!world_) {
    waiting_recalled_ = recalled;
    return;
  }
  if (recalled.world != *world_) {
    if (!recalled.restore) reasons_.add("recalled_of_other_world");
    return;
  }
  if (recalled.laid) return insertLaid(recalled);
  const bool asked = recalled.restore || for_all;
  if (!asked && !archive_.answered(recalled.request, recalled.kept, recalled.truncated)) {
    return reasons_.add("recalled_unasked");
  }
  insertRecalled(recalled);
}

}  // namespace perdure::semantic_filter
