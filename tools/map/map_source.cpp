#include "tools/map/map_source.h"

#include <numbers>
#include <sstream>
#include <utility>

#include "common/mapping/frames/laid_belief.h"
#include "services/map_store/core/graph/graph_answer.h"

namespace perdure::tools {
namespace {

template <class T>
T read(const std::string& path, Result<T> result) {
  if (!result) map_store::cannotReadMap(path, result.error());
  if constexpr (!std::is_void_v<T>) return *std::move(result);
}

/// Opens the file and begins a transaction, so that objects and graph are consistent even if a
/// service writes.
map_store::Connection openAtOneState(const std::string& path) {
  auto connection = map_store::openStoreForReading(path);
  read(path, connection.execute("BEGIN"));
  return connection;
}

}  // namespace

MapFile::MapFile(std::string path)
    : path_(std::move(path)),
      connection_(openAtOneState(path_)),
      working_(read(path_, reader_.working())) {
  const auto corrections = read(path_, reader_.corrections());
  if (corrections.empty()) return;
  identity_ = mapping::Identity(saved().facts, corrections);
  corrections_ = standingByObject(corrections, [&](ObjectId id) { return identity_.objectOf(id); });
}

const mapping::SavedMap& MapFile::saved() const {
  if (!saved_) saved_ = read(path_, reader_.graph()).map;
  return *saved_;
}

mapping::MapFrames MapFile::frames() const {
  return mapping::MapFrames(mapping::MapState({}, saved()));
}

const map_store::MapInM& MapFile::inM() {
  if (view_) return *view_;
  constexpr double kTile_m = 32.0;  // any value, because no tiles are requested
  view_.emplace(reader_, kTile_m, [this](ObjectId id) {
    const auto at = saved().records.find(id);
    return at == saved().records.end() ? nullptr : &at->second;
  });
  read(path_, view_->load(frames()));
  return *view_;
}

MapReply MapFile::ask(MapQuery query, MapFrameChoice frame) {
  if (query.kind == MapQueryKind::kById) query.object_id = identity_.objectOf(query.object_id);
  const WorldId newest = working_.value_or(Objects{}).world;
  const bool as_stored = frame == MapFrameChoice::kW || query.world.world != 0;
  auto found = read(path_, as_stored ? reader_.find(query, newest, query.limit)
                                     : inM().find(query, newest, query.limit));
  MapReply reply;
  reply.truncated = found.truncated;
  reply.objects = std::move(found.objects);
  reply.beliefs = std::move(found.beliefs);
  reply.corrections = std::move(found.corrections);
  return reply;
}

MapReply MapFile::graph(const MapQuery& query) const {
  mapping::Mapper mapper({}, saved());
  MapReply reply;
  map_store::putGraph(mapper, {}, working_.value_or(Objects{}).world, query, reply);
  return reply;
}

std::optional<GeoAnchor> MapFile::earthAnchor() const {
  std::istringstream numbers(read(path_, reader_.earthAnchor()));
  GeoAnchor anchor;
  double yaw_deg = 0.0;
  if (!(numbers >> anchor.latitude_deg >> anchor.longitude_deg >> anchor.height_m >> yaw_deg)) {
    return std::nullopt;
  }
  anchor.yaw = yaw_deg * std::numbers::pi / 180.0;
  const WorldId newest = working_.value_or(Objects{}).world;
  const mapping::MapFrames frames = this->frames();
  const auto last = frames.anchorOf(nullptr, newest, TimePoint::max());
  return frames.at(last, newest).provisional ? std::nullopt : std::optional(anchor);
}

Standing MapFile::standing(ObjectId id) const {
  MapQuery query;
  query.kind = MapQueryKind::kById;
  query.object_id = id;
  const auto found = read(path_, reader_.find(query, {}, 1));
  if (found.beliefs.empty()) {
    map_store::cannotReadMap(path_, {"no_object", "it no longer has the object"});
  }
  return standingOf(found.beliefs.front(), found.objects.front().world, saved(),
                    read(path_, reader_.mergedInto(id)));
}

std::vector<map_store::EndedObject> MapFile::ended() {
  auto ended = read(path_, reader_.ended());
  const mapping::MapFrames frames = this->frames();
  for (map_store::EndedObject& each : ended) {
    map_store::PlacedBelief& placed = each.last;
    const auto anchor = frames.anchorOf(nullptr, placed.world, placed.belief.last_seen);
    placed.belief = mapping::turned(frames.at(anchor, placed.world).T_MW, std::move(placed.belief));
  }
  return ended;
}

std::vector<mapping::Sight> MapFile::cameras() const {
  return mapping::sightsFrom(read(path_, reader_.cameras()));
}

TimePoint MapFile::time() const { return working_ ? working_->stamp.time : TimePoint(); }

}  // namespace perdure::tools
