// What the map's graph does to what is stored: it is loaded, followed, and told.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/mapping/frames/laid_belief.h"
#include "services/map_store/core/graph/graph_answer.h"
#include "services/map_store/node.h"

namespace perdure::map_store {
namespace {

constexpr double kAroundALoop_m = 70.0;
constexpr std::size_t kMostWithdrawn = 256;
constexpr std::size_t kMostNamed = 8;  // objects, in the words of an event

/// By what a loop was found, for people.
std::string witnessesOf(const mapping::PlaceMatch& match) {
  if (match.pairs.empty()) return fmt::format("{} landmarks that look alike", match.points);
  std::string names = fmt::format("{} objects (", match.pairs.size());
  for (std::size_t k = 0; k < std::min(match.pairs.size(), kMostNamed); ++k) {
    names += fmt::format("{}{}", k == 0 ? "" : ", ", match.pairs[k].first);
  }
  return names + (match.pairs.size() > kMostNamed ? ", …)" : ")");
}

/// Of another session, whose clock may have been another one.
ObjectBelief notLaterThan(TimePoint now, ObjectBelief belief) {
  belief.last_seen = std::min(belief.last_seen, now);
  belief.first_seen = std::min(belief.first_seen, belief.last_seen);
  belief.as_of = std::min(belief.as_of, now);
  return belief;
}

}  // namespace

void Node::loadGraph() {
  auto saved = database_.takeGraph();
  if (!saved) {  // a new graph would be written over it
    notice_ =
        "The map's graph cannot be read (" + saved.error().detail +
        "); objects are kept without it. Restart map_store once the disk of store.path is well.";
    return reasons_.add(saved.error());
  }
  graph_ = true;
  if (saved->malformed > 0) reasons_.add("graph_malformed", saved->malformed);
  mapper_ = mapping::Mapper(config_.mapping, std::move(saved->map));
  if (!newest_) return;
  // What the graph had laid when it was written last is in the working set alone: what is stored
  // of it in its own session's W is another belief.
  for (const ObjectBelief& belief : newest_->objects) {
    const mapping::ObjectRecord* record = mapper_.recordOf(belief.id);
    if (!belief.recalled || record == nullptr) continue;
    MapQuery query;
    query.kind = MapQueryKind::kById;
    query.object_id = belief.id;
    const auto stored = database_.reader().find(query, newest_->world, 1);
    if (!stored || stored->beliefs.empty()) continue;
    if (stored->beliefs.front().best().mean != belief.best().mean) laid_.insert(belief.id);
  }
}

void Node::onOdometry(const Odometry& odometry) {
  earth_.onOdometry(odometry);
  if (graph_) mapper_.onOdometry(odometry);
}

/// Where on Earth M lies, where that has changed since it was written last; else empty.
Node::NewEarth Node::newEarthAnchor() {
  const auto known = earth_.known();
  if (!known || earth_stored_ || told_earth_ == std::pair(mapper_.revision(), *known)) return {};
  const WorldId& world = newest_->world;
  const mapping::MapFrames frames(mapper_.graph(), mapper_.anchors());
  const auto place = earth_.ofMap(world, [&](TimePoint time) -> std::optional<RigidTransform> {
    const auto anchor = frames.anchorOf(nullptr, world, time);
    const bool alone = mapper_.anchors().empty();  // without a graph W is M
    const auto frame = frames.at(anchor, world);
    if (frame.provisional || (anchor == 0 && !alone)) return std::nullopt;
    return frame.T_MW;
  });
  return {place.value_or(""), {mapper_.revision(), *known}};
}

void Node::onLandmarks(const Landmarks& landmarks) {
  if (graph_) mapper_.onLandmarks(landmarks);
}

void Node::followGraph() {
  mapper_.onObjects(*newest_);
  const auto change = mapper_.takeChange();
  if (change.empty()) return resendOrders();
  split(change.splits);
  commit();  // what is laid is read from the file; and orders are known before they are obeyed
  tellLoops(change);
  tellWithdrawals(change);
  recallLaid(newest_->T_WB.p, kAroundALoop_m, change, true);
  orders_sent_ = newest_->stamp.time;
}

/// What the survivor is now was seen of the absorbed one.
void Node::split(const std::vector<MergeOrder>& splits) {
  for (const MergeOrder& order : splits) {
    removed_.erase(order.absorbed);
    laid_.erase(order.survivor);
    splits_[order.absorbed] = order.survivor;
    unwritten_splits_.insert(unwritten_splits_.begin(), order);
    auto left = left_.extract(order.survivor);
    if (left.empty()) continue;
    left.key() = left.mapped().belief.id = order.absorbed;
    left_.insert(std::move(left));
  }
  renameSplit(*newest_);
}

/// Until the filter has obeyed, what it has under a survivor's id is of the absorbed object.
void Node::renameSplit(Objects& next) {
  if (splits_.empty()) return;
  const auto find = [&](ObjectId id) {
    return std::find_if(next.objects.begin(), next.objects.end(),
                        [&](const ObjectBelief& b) { return b.id == id; });
  };
  std::erase_if(splits_, [&](const auto& split) {
    const auto survivor = find(split.second);
    const bool obeyed = find(split.first) != next.objects.end() || survivor == next.objects.end() ||
                        survivor->recalled;
    if (!obeyed) survivor->id = split.first;
    return obeyed;
  });
  std::sort(next.objects.begin(), next.objects.end(),
            [](const ObjectBelief& a, const ObjectBelief& b) { return a.id < b.id; });
}

/// Merges that were ordered and not done: a message may be lost, and either side may have begun
/// anew since.
void Node::resendOrders() {
  constexpr Duration kEach = std::chrono::seconds(1);
  if (orders_sent_ && newest_->stamp.time - *orders_sent_ < kEach &&
      newest_->stamp.time >= *orders_sent_) {
    return;
  }
  orders_sent_ = newest_->stamp.time;
  std::map<ObjectId, bool> recalled;
  for (const ObjectBelief& belief : newest_->objects) recalled[belief.id] = belief.recalled;
  mapping::MapChange again;
  for (const auto& [absorbed, merge] : std::map(mapper_.merges())) {
    if (merge.done) continue;
    const auto survivor = recalled.find(merge.survivor);
    if (recalled.contains(absorbed)) {
      again.merges.push_back({merge.loop, merge.survivor, absorbed});
    } else if (adopts_merges_ && survivor != recalled.end() && !survivor->second) {
      mapper_.onMerged(merge.survivor, absorbed);
      removed_[absorbed] = {EventKind::kMerged, newest_->stamp.time, merge.survivor};
      dirty_ = true;
    }
  }
  adopts_merges_ = false;
  if (!again.merges.empty()) recallLaid(newest_->T_WB.p, kAroundALoop_m, again, false);
}

void Node::tellWithdrawals(const mapping::MapChange& change) {
  for (const mapping::LoopWithdrawal& loop : change.withdrawn) {
    std::string split;
    for (const MergeOrder& order : change.splits) {
      if (order.loop != loop.id) continue;
      split +=
          fmt::format("{}{} from {}", split.empty() ? "" : ", ", order.absorbed, order.survivor);
    }
    Event event;
    event.stamp = newest_->stamp;
    event.instance = instance_;
    event.world = newest_->world;
    event.kind = EventKind::kLoopWithdrawn;
    event.detail = fmt::format(
        "loop {} is contradicted by later ones; objects that are two again: {}; anchors {} and {}",
        loop.id, split.empty() ? "none" : split, loop.a, loop.b);
    outputs_.event(event);
    reasons_.add("loops_withdrawn");
    withdrawn_.push_back(loop);
    if (withdrawn_.size() > kMostWithdrawn) withdrawn_.pop_front();
  }
}

void Node::tellLoops(const mapping::MapChange& change) {
  for (const mapping::LoopClosure& loop : change.loops) {
    Event event;
    event.stamp = newest_->stamp;
    event.instance = instance_;
    event.world = newest_->world;
    event.kind = loop.joins ? EventKind::kRelocalised : EventKind::kLoopClosed;
    event.probability = 1.0 / (1.0 + std::exp(loop.match.next - loop.match.score));
    event.detail = fmt::format(
        "loop {}, by {}, {:.1f} nats likelier than the best other way; the body's "
        "place "
        "on the map moved by {:.2f} m; anchors {} and {}",
        loop.id, witnessesOf(loop.match), loop.match.score - loop.match.next, loop.correction_m,
        loop.a, loop.b);
    outputs_.event(event);
    reasons_.add(loop.joins ? "relocalised" : "loops_closed");
  }
}

/// Where it changes: after a loop, in a new session, and now and then as the way goes on.
void Node::tellFrame() {
  if (!newest_ || !mapper_.follows(newest_->world)) return;
  const ToldFrame now{newest_->world, mapper_.revision(), mapper_.anchors().size()};
  if (told_frame_ == now) return;
  const auto whole = mapper_.frame();
  if (!whole) return;
  told_frame_ = now;
  MapFrame frame;
  frame.stamp = newest_->stamp;
  frame.instance = instance_;
  frame.world = newest_->world;
  frame.map = whole->map;
  frame.T_MW = whole->T_MW;
  frame.covariance = whole->covariance;
  frame.revision = now.revision;
  frame.sessions = whole->sessions;
  frame.loops = whole->loops;
  frame.anchors = static_cast<std::uint32_t>(now.anchors);
  outputs_.frame(frame);
}

/// As it is now, however often the same is asked: it is not kept among the answers.
void Node::answerGraph(const MapQuery& query) {
  MapReply reply = emptyReply(query);
  reply.error = faultOf(query);
  if (reply.error.empty() && !graph_) {
    reply.error = "the map has no graph; set graph.enabled of map_store, and look at its Health";
  }
  reply.ok = reply.error.empty();
  if (reply.ok) {
    putGraph(mapper_, {withdrawn_.begin(), withdrawn_.end()}, newest_ ? newest_->world : WorldId{},
             query, reply);
  } else {
    reasons_.add("query_refused");
  }
  outputs_.reply(reply);
}

std::optional<ObjectBelief> Node::laidNow(const mapping::Recallable& there) {
  MapQuery query;
  query.kind = MapQueryKind::kById;
  query.object_id = there.id;
  auto found = database_.reader().find(query, newest_->world, 1);
  if (!found) {
    blame(found.error());
    return std::nullopt;
  }
  if (found->beliefs.empty()) return std::nullopt;
  ObjectBelief belief = mapping::turned(
      *there.T_now, mapping::relativeToBody(found->beliefs.front(), there.pose_error));
  belief = mapping::withFrameError(std::move(belief), there.covariance, there.about_W);
  return notLaterThan(newest_->stamp.time, std::move(belief));
}

void Node::recallLaid(const Eigen::Vector3d& centre_W, double radius_m,
                      const mapping::MapChange& change, bool lay_again) {
  Recalled recalled;
  recalled.instance = instance_;
  recalled.world = newest_->world;
  recalled.client = newest_->instance;
  recalled.next_id = next_id_;
  recalled.laid = recalled.graph = true;
  recalled.merges = change.merges;
  recalled.splits = change.splits;
  std::set<ObjectId> working;
  for (const auto& belief : newest_->objects) working.insert(belief.id);
  for (const mapping::Recallable& there : mapper_.near(centre_W, radius_m)) {
    const bool again = lay_again && laid_.contains(there.id);
    if (!there.T_now || (working.contains(there.id) && !again)) continue;
    auto belief = laidNow(there);
    if (!belief) continue;
    laid_.insert(there.id);
    recalled.objects.push_back(std::move(*belief));
  }
  if (recalled.objects.empty() && change.merges.empty() && change.splits.empty()) return;
  outputs_.recalled(recalled);
}

}  // namespace perdure::map_store
