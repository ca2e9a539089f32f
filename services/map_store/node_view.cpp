// The node's functions for the published map: tiles and answers, in M.
#include <algorithm>
#include <utility>

#include "services/map_store/node.h"

namespace perdure::map_store {

bool Node::loadView() {
  const auto done = view_.load(graph_ ? mapping::MapFrames(mapper_.graph(), mapper_.anchors())
                                      : mapping::MapFrames());
  if (!done) {
    blame(done.error());
    return false;
  }
  view_revision_ = mapper_.revision();
  view_anchors_ = mapper_.anchors().size();
  return true;
}

/// Updates the view. Must directly follow a commit, because the stored rows and the graph must have
/// the same state.
void Node::followView(const std::vector<ObjectId>& changed) {
  const bool moved = mapper_.revision() != view_revision_;
  if (moved || mapper_.anchors().size() != view_anchors_) {
    view_.follow(mapping::MapFrames(mapper_.graph(), mapper_.anchors()), moved);
    view_revision_ = mapper_.revision();
    view_anchors_ = mapper_.anchors().size();
    header_stale_ = header_stale_ || moved;
  }
  if (const auto done = view_.refresh(changed); !done) blame(done.error());
}

void Node::publish() {
  if (!view_.isLoaded() && !loadView()) return;
  published_once_ = true;
  for (auto& [square, ids] : view_.takeStale()) stale_squares_[square] = std::move(ids);
  while (!stale_squares_.empty()) {
    const auto square = stale_squares_.begin();
    if (!publishSquare(square->first, square->second)) return;
    stale_squares_.erase(square);
  }
  header_stale_ = false;
  if (graph_) reportFrame();
  outputs_.header({instance_, revision_, config_.tile_size_m, tiles_.tiles(), tiles_.objects()});
}

bool Node::publishSquare(const Square& square, const std::vector<ObjectId>& ids) {
  auto found = view_.objects(ids);
  if (!found) {
    blame(found.error());
    header_stale_ = true;  // the next tick tries again
    return false;
  }
  if (found->malformed > 0) reasons_.add("belief_malformed", found->malformed);
  const auto changes = tiles_.replace(square, std::move(found->objects), instance_, revision_);
  for (const auto& tile : changes.tiles) outputs_.tile(tile);
  for (const auto& key : changes.emptied) outputs_.emptied(key);
  return true;
}

/// Answers a query in its W if it has one, else in M.
Result<Found> Node::find(const MapQuery& query) {
  const WorldId newest = newest_ ? newest_->world : WorldId{};
  const auto limit = std::min(query.limit, static_cast<std::uint32_t>(config_.query_limit));
  if (query.world.world != 0) return database_.reader().find(query, newest, limit);
  if (!view_.isLoaded() && !loadView()) {
    return fail("map_unread", "where its objects lie is not known yet");
  }
  return view_.find(query, newest, limit);
}

}  // namespace perdure::map_store
