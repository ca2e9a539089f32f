// The node's functions for the graph: loading, updates, events and queries.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "services/map_store/core/graph/graph_answer.h"
#include "services/map_store/node.h"

namespace perdure::map_store {
namespace {

constexpr std::size_t kMostWithdrawn = 256;
constexpr std::size_t kMostNamed = 8;  // largest number of objects in the text of an event

/// The evidence of a loop closure, as text for users.
std::string witnessesOf(const mapping::PlaceMatch& match) {
  if (match.pairs.empty()) return fmt::format("{} landmarks that look alike", match.points);
  std::string names = fmt::format("{} objects (", match.pairs.size());
  for (std::size_t k = 0; k < std::min(match.pairs.size(), kMostNamed); ++k) {
    names += fmt::format("{}{}", k == 0 ? "" : ", ", match.pairs[k].first);
  }
  return names + (match.pairs.size() > kMostNamed ? ", …)" : ")");
}

}  // namespace

void Node::loadGraph() {
  auto saved = database_.takeGraph();
  if (!saved) {  // the graph stays disabled, because a new one would overwrite the stored one
    notice_ =
        "The map's graph cannot be read (" + saved.error().detail +
        "); objects are kept without it. Restart map_store once the disk of store.path is well.";
    return reasons_.add(saved.error());
  }
  graph_ = true;
  if (saved->malformed > 0) reasons_.add("graph_malformed", saved->malformed);
  mapper_ = mapping::Mapper(config_.mapping, std::move(saved->map));
  if (!newest_) return;
  // A belief that the graph placed before the last write is only in the working set. It differs
  // from the stored belief, which is in the W of its session.
  for (const ObjectBelief& belief : newest_->objects) {
    if (!belief.recalled) continue;
    const auto stored = database_.reader().beliefOf(belief.id);
    if (!stored || !*stored) continue;
    if ((*stored)->belief.best().mean != belief.best().mean) placed_[belief.id] = {};
  }
}

/// Loads the facts if there is no graph, because they determine the object ids.
void Node::loadFacts() {
  auto facts = database_.reader().facts();
  if (!facts) return blame(facts.error());
  auto corrections = database_.reader().corrections();
  if (!corrections) {
    reasons_.add(corrections.error());
    notice_ += "The corrections cannot be read (" + corrections.error().detail +
               "), so they have no effect; restore a copy of the file.";
  }
  mapping::SavedMap map;
  map.facts = *std::move(facts);
  if (corrections) map.corrections = *std::move(corrections);
  mapper_ = mapping::Mapper(config_.mapping, std::move(map));
}

void Node::onOdometry(const Odometry& odometry) {
  earth_.onOdometry(odometry);
  if (graph_) mapper_.onOdometry(odometry);
}

/// Returns the position of M on Earth if it has changed since the last write; else an empty text.
Node::NewEarth Node::newEarthAnchor() {
  const auto known = earth_.known();
  if (!known || earth_stored_ || told_earth_ == std::pair(mapper_.revision(), *known)) return {};
  const WorldId& world = newest_->world;
  const mapping::MapFrames frames(mapper_.graph(), mapper_.anchors());
  const auto place = earth_.ofMap(world, [&](TimePoint time) -> std::optional<RigidTransform> {
    const auto anchor = frames.anchorOf(nullptr, world, time);
    const bool alone = mapper_.anchors().empty();  // if there are no anchors, W is M
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
  if (change.empty()) return;
  for (const mapping::SameObject& fact : change.facts) joins_[fact.a] = {fact.b, 0};
  reportLoops(change);
  reportWithdrawals(change);
  commit();  // the commit also sends map/near, with the beliefs in the rows of the regrouped tracks
}

void Node::reportWithdrawals(const mapping::MapChange& change) {
  for (const mapping::LoopWithdrawal& loop : change.withdrawn) {
    std::string split;
    for (const mapping::MergeOrder& order : change.splits) {
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

void Node::reportLoops(const mapping::MapChange& change) {
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

/// Publishes T_MW if it may have changed: in a new session, after a change of the graph, and with
/// each new anchor.
void Node::reportFrame() {
  if (!newest_ || !mapper_.follows(newest_->world)) return;
  const ReportedFrame now{newest_->world, mapper_.revision(), mapper_.anchors().size()};
  if (reported_frame_ == now) return;
  const auto whole = mapper_.frame();
  if (!whole) return;
  reported_frame_ = now;
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

/// Answers with the current state, even if the request is repeated. The reply is therefore not
/// stored in the cache.
void Node::answerGraph(const MapQuery& query) {
  MapReply reply = emptyReply(query.client, query.request);
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

}  // namespace perdure::map_store
