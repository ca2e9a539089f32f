#include "services/map_store/node.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/mapping/frames/sight.h"

namespace perdure::map_store {
namespace {

StoreOptions storeOptions(const Config& c) {
  return {c.store_path, c.tile_size_m, c.max_size_mb, c.check_at_start, !c.fleet.url.empty()};
}

}  // namespace

std::string faultOf(const MapQuery& query) {
  if (query.limit == 0) return "limit is 0; it must be at least 1";
  switch (query.kind) {
    case MapQueryKind::kByRadius:
    case MapQueryKind::kGraph:
      if (!query.low.allFinite() || !std::isfinite(query.radius) || query.radius < 0.0) {
        return std::string(query.kind == MapQueryKind::kGraph ? "a graph" : "a radius") +
               " query needs a finite centre and a radius of at least 0 m";
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
    case MapQueryKind::kById:
    case MapQueryKind::kAll:
    case MapQueryKind::kRestore:
      return {};
  }
  return "kind " + std::to_string(static_cast<int>(query.kind)) +
         " is not known; what comes near is on map/near, unasked";
}

namespace {

/// Returns the working set by tracks, as the filter estimates it without the corrections of people.
Objects byTrack(Objects objects) {
  for (ObjectBelief& own : objects.as_estimated) {
    const auto at = std::ranges::find(objects.objects, own.trackId(), &ObjectBelief::trackId);
    at == objects.objects.end() ? objects.objects.push_back(std::move(own))
                                : void(*at = std::move(own));
  }
  objects.as_estimated.clear();
  for (ObjectBelief& belief : objects.objects) {
    belief.id = belief.trackId();
    belief.track = 0;
  }
  return objects;
}

std::string fixOf(const Reason& reason) {
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
  if (!graph_) loadFacts();
  publishCorrections();
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
  Objects next = byTrack(objects);
  for (const auto& belief : next.objects) {
    // A recalled belief has not been detected since the graph placed it, so it is not a new
    // observation.
    if (!belief.recalled) placed_.erase(belief.id);
  }
  std::erase_if(next.objects, [this](const ObjectBelief& b) { return !acceptable(b); });
  takeEnded(next.ended);
  leaveBehind(next);
  if (!same_filter || newest_->world != next.world) client_since_ = next.stamp.time;
  if (newest_ && !same_filter) previous_ = std::move(newest_);
  // The filter that assigns the ids has the correct next_id. The next_id of a new filter may be too
  // low, because it may not be restored yet.
  next_id_ = same_filter ? next.next_id : std::max(next_id_, next.next_id);
  newest_ = std::move(next);
  dirty_ = true;
  if (graph_) followGraph();
  constexpr double kStep_m = 20.0 / 3.0;  // the radius of map/near includes this margin
  const bool moved = !near_from_W_ || (newest_->T_WB.p - *near_from_W_).norm() > kStep_m;
  if (moved || !same_filter) sendNear();
}

/// Returns whether the track was confirmed in the newest working set. Unknown tracks count as
/// confirmed.
bool Node::wasConfirmed(TrackId track) const {
  if (!newest_) return true;
  const auto at = std::find_if(newest_->objects.begin(), newest_->objects.end(),
                               [&](const ObjectBelief& b) { return b.id == track; });
  return at == newest_->objects.end() || at->confirmed;
}

/// Processes the ended tracks that were not in the previous message.
void Node::takeEnded(const std::vector<EndedTrack>& ended) {
  for (const EndedTrack& each : ended) {
    if (newest_ &&
        std::find(newest_->ended.begin(), newest_->ended.end(), each) != newest_->ended.end()) {
      continue;
    }
    const bool merged = each.into != 0;
    merged ? mapper_.onMerged(each.into, each.track, wasConfirmed(each.track))
           : mapper_.onGone(each.track);
    removed_[each.track] = {merged ? EventKind::kMerged : EventKind::kGone, each.time, each.into};
  }
}

/// Keeps the beliefs of confirmed tracks that `next` does not contain, because their last beliefs
/// may not be stored yet.
void Node::leaveBehind(const Objects& next) {
  std::set<ObjectId> alive;
  for (const auto& belief : next.objects) alive.insert(belief.id);
  for (const ObjectId id : alive) left_.erase(id);
  if (!newest_) return;
  for (auto& belief : newest_->objects) {
    if (alive.contains(belief.id)) continue;
    const bool as_it_was = placed_.erase(belief.id) > 0;  // it left without a detection after the
                                                          // graph placed it
    if (belief.confirmed && !as_it_was) left_[belief.id] = {newest_->world, belief};
  }
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

/// Returns what the cameras see, if that is not stored yet; else an empty text.
std::string Node::camerasText() const {
  if (!cameras_) return {};
  return mapping::toText(mapping::sightsOf(*cameras_, newest_->T_WB, newest_->up_W));
}

void Node::commit() {
  if (!newest_) {  // ended tracks need a working set first
    dirty_ = false;
    return;
  }
  const mapping::Unsaved unsaved = mapper_.unsaved();
  const NewEarth earth = newEarthAnchor();
  std::set<TrackId> placed;
  for (const auto& [track, given] : placed_) placed.insert(track);
  const auto written =
      database_.write({&*newest_, left_, removed_, std::move(placed), graph_ ? &unsaved : nullptr,
                       &mapper_.identity(), &unsaved, mapper_.regrouped(), acknowledged_,
                       earth.text, camerasText()});
  if (!written) {
    blame(written.error());
    return;  // dirty_ is still true, so the next tick tries again
  }
  mapper_.markSaved();
  if (written->unsound > 0) reasons_.add("graph_unsound", written->unsound);
  if (!earth.text.empty()) told_earth_ = earth.of;
  cameras_.reset();
  failure_.clear();
  dirty_ = false;
  acknowledged_ = 0;
  kept_of_ = newest_->instance;
  kept_ = newest_->stamp.time;
  left_.clear();
  removed_.clear();
  ++commits_;
  header_stale_ = header_stale_ || written->revision != revision_ || !corrected_.empty();
  revision_ = written->revision;
  publishCorrections();
  corrected_.insert(written->objects.begin(), written->objects.end());
  followView({corrected_.begin(), corrected_.end()});
  corrected_.clear();
  sendNear();
}

void Node::onQuery(const MapQuery& query) {
  if (query.kind == MapQueryKind::kRestore) return restore(query);
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

MapReply Node::emptyReply(InstanceId client, std::uint64_t request) const {
  MapReply reply;
  reply.client = client;
  reply.request = request;
  reply.instance = instance_;
  return reply;
}

MapReply Node::answer(const MapQuery& query) {
  MapReply reply = emptyReply(query.client, query.request);
  reply.error = faultOf(query);
  if (reply.error.empty()) {
    MapQuery present = query;  // asks for the object of a track that was joined to another one
    if (query.kind == MapQueryKind::kById) {
      present.object_id = mapper_.identity().objectOf(query.object_id);
    }
    auto found = find(present);
    if (found) {
      if (found->malformed > 0) reasons_.add("belief_malformed", found->malformed);
      reply.truncated = found->truncated;
      reply.objects = std::move(found->objects);
      reply.beliefs = std::move(found->beliefs);
      reply.corrections = std::move(found->corrections);
      return reply;
    }
    blame(found.error());
    reply.error = "the map cannot be read (" + found.error().detail + ")";
  }
  reply.ok = false;
  return reply;
}

void Node::blame(const Reason& reason) {
  reasons_.add(reason);
  failure_ = "The map cannot be written or read (" + reason.detail + "); " + fixOf(reason) + ".";
}

}  // namespace perdure::map_store
