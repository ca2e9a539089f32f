#include "services/map_store/core/map_places.h"

#include <algorithm>
#include <utility>

#include "common/mapping/frames/laid_belief.h"

namespace perdure::map_store {
namespace {

constexpr double kShown_m = 0.1;  // smaller displacements are not published

bool isInside(const Eigen::Vector3d& p, const MapQuery& query) {
  return (p.array() >= query.low.array()).all() && (p.array() <= query.high.array()).all();
}

}  // namespace

void MapPlaces::show(Place& place) {
  if (place.square) stale_.insert(*place.square);
  place.square = squareOf(place.p_M, tile_size_m_);
  if (place.square) stale_.insert(*place.square);
  place.moved_m = 0.0;
}

void MapPlaces::put(const StoredPlace& stored, const mapping::ObjectRecord* record,
                    const mapping::MapFrames& frames) {
  Place& place = places_[stored.id];
  place.anchor = frames.anchorOf(record, stored.world, stored.last_seen);
  const mapping::FrameInMap frame = frames.at(place.anchor, stored.world);
  place.p_W = stored.p_W;
  place.p_M = frame.T_MW * stored.p_W;
  place.map = frame.map;
  place.provisional = frame.provisional;
  show(place);
}

void MapPlaces::erase(ObjectId id) {
  const auto at = places_.find(id);
  if (at == places_.end()) return;
  if (at->second.square) stale_.insert(*at->second.square);
  places_.erase(at);
}

void MapPlaces::lay(const mapping::MapFrames& frames) {
  for (auto& [id, place] : places_) {
    const mapping::FrameInMap frame = frames.at(place.anchor, place.map);
    const Eigen::Vector3d p_M = frame.T_MW * place.p_W;
    place.moved_m += (p_M - place.p_M).norm();
    place.p_M = p_M;
    const bool is_told_otherwise = frame.map != place.map || frame.provisional != place.provisional;
    place.map = frame.map;
    place.provisional = frame.provisional;
    if (is_told_otherwise || place.moved_m > kShown_m) show(place);
  }
}

mapping::AnchorId MapPlaces::anchorOf(ObjectId id) const {
  const auto at = places_.find(id);
  return at == places_.end() ? 0 : at->second.anchor;
}

std::vector<ObjectId> MapPlaces::find(const MapQuery& query, const WorldId& map) const {
  const bool by_radius = query.kind == MapQueryKind::kByRadius;
  std::vector<std::pair<double, ObjectId>> found;
  for (const auto& [id, place] : places_) {
    if (place.map != map) continue;
    const double distance2 = (place.p_M - query.low).squaredNorm();
    if (by_radius ? distance2 <= query.radius * query.radius : isInside(place.p_M, query)) {
      found.emplace_back(by_radius ? distance2 : 0.0, id);
    }
  }
  std::sort(found.begin(), found.end());
  std::vector<ObjectId> ids;
  for (const auto& [distance2, id] : found) ids.push_back(id);
  return ids;
}

std::map<Square, std::vector<ObjectId>> MapPlaces::takeStale() {
  std::map<Square, std::vector<ObjectId>> result;
  for (const Square& square : std::exchange(stale_, {})) result[square];
  if (result.empty()) return result;
  for (const auto& [id, place] : places_) {
    if (!place.square) continue;
    const auto at = result.find(*place.square);
    if (at != result.end()) at->second.push_back(id);
  }
  return result;
}

Result<void> MapInM::load(mapping::MapFrames frames) {
  const auto all = reader_.places();
  if (!all) return tl::unexpected<Reason>(all.error());
  frames_ = std::move(frames);
  for (const StoredPlace& stored : *all) places_.put(stored, records_(stored.id), frames_);
  loaded_ = true;
  return {};
}

Result<void> MapInM::refresh(const std::vector<ObjectId>& changed) {
  unread_.insert(changed.begin(), changed.end());
  while (!unread_.empty()) {
    const ObjectId id = *unread_.begin();
    const auto stored = reader_.placeOf(id);
    if (!stored) return tl::unexpected<Reason>(stored.error());
    if (*stored) {
      places_.put(**stored, records_(id), frames_);
    } else {
      places_.erase(id);
    }
    unread_.erase(id);
  }
  return {};
}

void MapInM::follow(mapping::MapFrames frames, bool moved) {
  frames_ = std::move(frames);
  if (moved) places_.lay(frames_);
}

Result<Found> MapInM::inM(Result<Found> found) const {
  if (!found) return found;
  for (std::size_t k = 0; k < found->objects.size(); ++k) {
    MapObject& object = found->objects[k];
    const auto frame = frames_.at(places_.anchorOf(object.id), object.world);
    object = mapping::turned(frame.T_MW, std::move(object));
    object.world = frame.map;
    object.provisional = frame.provisional;
    if (k >= found->beliefs.size()) continue;
    found->beliefs[k] = mapping::turned(frame.T_MW, std::move(found->beliefs[k]));
  }
  return found;
}

Result<Found> MapInM::find(const MapQuery& query, const WorldId& newest,
                           std::uint32_t limit) const {
  const bool by_place = query.kind == MapQueryKind::kByRadius || query.kind == MapQueryKind::kByBox;
  if (!by_place) return inM(reader_.find(query, newest, limit));
  return inM(reader_.byIds(places_.find(query, frames_.mapOf(newest)), limit));
}

Result<Found> MapInM::objects(const std::vector<ObjectId>& ids) const {
  return inM(reader_.byIds(ids, ids.size()));
}

}  // namespace perdure::map_store
