#include "services/map_store/node.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace perdure::map_store {
namespace {

StoreOptions storeOptions(const Config& c) {
  return {c.store_path, c.tile_size_m, c.max_size_mb, c.check_at_start, !c.fleet.url.empty()};
}

}  // namespace

std::string faultOf(const MapQuery& query) {
  if (query.limit == 0) return "limit is 0; ask for at least one object";
  switch (query.kind) {
    case MapQueryKind::kByRadius:
    case MapQueryKind::kRecall:
    case MapQueryKind::kGraph:
      if (!query.low.allFinite() || !std::isfinite(query.radius) || query.radius < 0.0) {
        return "a radius query needs a finite centre and a radius of at least 0 m";
      }
      return {};
    case MapQueryKind::kByBox:
      if (!query.low.allFinite() || !query.high.allFinite() ||
          (query.low.array() > query.high.array()).any()) {
        return "a box query needs two finite corners, low at most high in each axis";
      }
      return {};
    case MapQueryKind::kByClass:
      return query.class_name.empty() ? "a class query needs the name of a class" : "";
    default:
      return {};
  }
}

namespace {

std::string mendOf(const Reason& reason) {
  if (reason.code == "disk_full") return "free space, or raise store.max_size";
  if (reason.code == "read_only") return "make store.path writable for this user";
  if (reason.code == "busy") return "end the other program that writes the map";
  if (reason.code == "corrupt") return "restart map_store: it sets the damaged file aside";
  return "look at the disk of store.path";
}

}  // namespace

Node::Node(const Config& config, InstanceId instance, Outputs outputs)
    : config_(config),
      instance_(instance),
      outputs_(std::move(outputs)),
      database_(storeOptions(config)),
      mapper_(config.mapping),
      replies_(static_cast<std::size_t>(config.cached_replies)),
      view_(database_.reader(), config.tile_size_m,
            [this](ObjectId id) { return mapper_.recordOf(id); }),
      notice_(database_.notice()) {
  if (!notice_.empty()) reasons_.add("map_set_aside");
  auto working = database_.reader().working();
  const auto revision = database_.reader().revision();
  const auto largest = database_.reader().largestId();
  if (revision) revision_ = *revision;
  if (largest) next_id_ = *largest + 1;
  if (!working) {
    blame(working.error());
  } else if (*working) {
    newest_ = std::move(**working);
    kept_of_ = newest_->instance;
    kept_ = newest_->stamp.time;
    next_id_ = std::max(next_id_, newest_->next_id);
  }
  if (next_id_ > 1) next_id_ += kIdReserve;
  if (config_.graph) loadGraph();
  earth_stored_ = graph_ && !database_.reader().earthAnchor().value_or("").empty();
  (void)loadView();
}

bool Node::acceptable(const ObjectBelief& belief) {
  const bool good = belief.id != 0 && !belief.classes.empty() &&
                    squareOf(belief.best().mean.head<3>(), config_.tile_size_m).has_value();
  if (!good) reasons_.add("object_invalid");
  return good;
}

void Node::onObjects(const Objects& objects) {
  ++received_;
  const bool same_filter = newest_ && newest_->instance == objects.instance;
  if (same_filter && newest_->stamp.sameFrame(objects.stamp)) {
    reasons_.add("objects_repeated");
    return;
  }
  Objects next = objects;
  if (graph_) {
    // Where the graph laid what has not been seen since is not a new observation.
    for (const auto& belief : next.objects) {
      if (!belief.recalled) laid_.erase(belief.id);
    }
  }
  std::erase_if(next.objects, [this](const ObjectBelief& b) { return !acceptable(b); });
  renameSplit(next);
  leaveBehind(next);
  if (newest_ && !same_filter) previous_ = std::move(newest_);
  // The filter whose ids these are knows the next one; another one may not have been restored yet.
  next_id_ = same_filter ? next.next_id : std::max(next_id_, next.next_id);
  newest_ = std::move(next);
  dirty_ = true;
  if (!graph_) return;
  followGraph();
}

/// Confirmed objects that `next` no longer holds: their last belief may not have been written.
void Node::leaveBehind(const Objects& next) {
  std::set<ObjectId> alive;
  for (const auto& belief : next.objects) alive.insert(belief.id);
  for (const ObjectId id : alive) left_.erase(id);
  if (!newest_) return;
  for (auto& belief : newest_->objects) {
    if (alive.contains(belief.id)) continue;
    const bool as_it_was = laid_.erase(belief.id) > 0;  // laid, and left without being seen
    if (belief.confirmed && !as_it_was) left_[belief.id] = {newest_->world, belief};
  }
}

void Node::onEvent(const Event& event) {
  if (event.instance == instance_) return;
  if (graph_ && event.kind == EventKind::kGone) mapper_.onGone(event.object_id);
  if (graph_ && event.kind == EventKind::kMerged) {
    mapper_.onMerged(event.object_id, event.other_id);
  }
  if (event.kind == EventKind::kGone) {
    removed_[event.object_id] = {event.kind, event.stamp.time, 0};
  } else if (event.kind == EventKind::kMerged) {
    removed_[event.other_id] = {event.kind, event.stamp.time, event.object_id};
  } else {
    return;
  }
  dirty_ = true;
}

void Node::tick(Duration now) {
  const auto due = [now](const std::optional<Duration>& last, double period_s) {
    return !last || now - *last >= durationFromSeconds(period_s);
  };
  if (dirty_ && due(committed_at_, config_.commit_period_s)) {
    committed_at_ = now;
    commit();
  }
  if (!published_once_ || (header_stale_ && due(published_at_, config_.tile_period_s))) {
    published_at_ = now;
    publish();
  }
}

void Node::flush() {
  if (dirty_) commit();
  publish();
}

void Node::commit() {
  if (!newest_) {  // only events so far: they wait for a working set
    dirty_ = false;
    return;
  }
  const mapping::Unsaved graph = graph_ ? mapper_.unsaved() : mapping::Unsaved();
  const NewEarth earth = newEarthAnchor();
  const auto written =
      database_.write({&*newest_, left_, removed_, laid_, graph_ ? &graph : nullptr,
                       unwritten_splits_, acknowledged_, earth.text});
  if (!written) {
    blame(written.error());
    return;  // still dirty: it is tried again
  }
  if (graph_) mapper_.markSaved();
  if (written->unsound > 0) reasons_.add("graph_unsound", written->unsound);
  if (!earth.text.empty()) told_earth_ = earth.of;
  failure_.clear();
  dirty_ = false;
  acknowledged_ = 0;
  kept_of_ = newest_->instance;
  kept_ = newest_->stamp.time;
  left_.clear();
  removed_.clear();
  unwritten_splits_.clear();
  ++commits_;
  header_stale_ = header_stale_ || written->revision != revision_;
  revision_ = written->revision;
  followView(written->objects);
}

void Node::onQuery(const MapQuery& query) {
  if (query.kind == MapQueryKind::kRestore) return restore(query);
  if (query.kind == MapQueryKind::kRecall && faultOf(query).empty()) return recall(query);
  if (query.kind == MapQueryKind::kGraph) return answerGraph(query);
  if (const MapReply* again = replies_.find(query.client, query.request)) {
    reasons_.add("query_repeated");
    return outputs_.reply(*again);
  }
  MapReply reply = answer(query);
  if (!reply.ok) reasons_.add("query_refused");
  outputs_.reply(reply);
  replies_.keep(std::move(reply));
}

MapReply Node::emptyReply(const MapQuery& query) const {
  MapReply reply;
  reply.client = query.client;
  reply.request = query.request;
  reply.instance = instance_;
  return reply;
}

MapReply Node::answer(const MapQuery& query) {
  MapReply reply = emptyReply(query);
  reply.error = faultOf(query);
  if (reply.error.empty()) {
    auto found = find(query);
    if (found) {
      if (found->malformed > 0) reasons_.add("belief_malformed", found->malformed);
      reply.truncated = found->truncated;
      reply.objects = std::move(found->objects);
      reply.beliefs = std::move(found->beliefs);
      return reply;
    }
    blame(found.error());
    reply.error = "the map cannot be read (" + found.error().detail + ")";
  }
  reply.ok = false;
  return reply;
}

const Objects* Node::workingSetFor(const MapQuery& query) const {
  // A filter that published before it asked wants what its predecessor knew.
  const auto& set = newest_ && newest_->instance == query.client ? previous_ : newest_;
  if (!set || (query.world.world != 0 && query.world != set->world)) return nullptr;
  return &*set;
}

void Node::restore(const MapQuery& query) {
  Recalled recalled;
  recalled.instance = instance_;
  recalled.restore = true;
  recalled.client = query.client;
  recalled.world = query.world;
  recalled.next_id = next_id_;
  if (const Objects* set = workingSetFor(query)) {
    recalled.world = set->world;
    for (const auto& belief : set->objects) {
      if (!removed_.contains(belief.id)) recalled.objects.push_back(belief);
    }
  }
  reasons_.add("restores");
  outputs_.recalled(recalled);
}

/// What the filter has just let go is written first: the answer is about what it has now.
void Node::recall(const MapQuery& query) {
  if (dirty_) commit();
  const auto limit = std::min(query.limit, static_cast<std::uint32_t>(config_.query_limit));
  auto found = database_.reader().longTermNear(query.low, query.radius, query.world, limit);
  if (!found) return blame(found.error());
  if (found->malformed > 0) reasons_.add("belief_malformed", found->malformed);
  // A filter that looks for the map of a frame that has ended lays it by itself.
  const bool by_graph =
      graph_ && newest_ && query.world == newest_->world && mapper_.follows(query.world);
  if (by_graph) {
    constexpr double kAround_m = 10.0;  // places in M and in W differ
    std::set<ObjectId> as_stored;
    for (const mapping::Recallable& there : mapper_.near(query.low, query.radius + kAround_m)) {
      if (!there.T_now) as_stored.insert(there.id);
    }
    std::erase_if(found->beliefs, [&](const ObjectBelief& b) {
      return mapper_.holds(b.id) && !as_stored.contains(b.id);
    });
  }
  Recalled recalled;
  recalled.instance = instance_;
  recalled.world = query.world;
  recalled.client = query.client;
  recalled.next_id = next_id_;
  recalled.objects = std::move(found->beliefs);
  recalled.request = query.request;
  recalled.graph = by_graph;
  if (kept_of_ == query.client) recalled.kept = kept_;
  recalled.truncated = found->truncated;
  outputs_.recalled(recalled);
  if (by_graph) recallLaid(query.low, query.radius, {}, false);
}

void Node::blame(const Reason& reason) {
  reasons_.add(reason);
  failure_ = "The map cannot be written or read (" + reason.detail + "); " + mendOf(reason) + ".";
}

}  // namespace perdure::map_store
