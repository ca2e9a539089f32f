#include "tools/map/map_source.h"

#include <chrono>
#include <numbers>
#include <optional>
#include <sstream>

#include "common/bus/topics.h"
#include "common/bus/wait_loop.h"
#include "services/map_store/core/graph/graph_answer.h"
#include "services/map_store/core/map_places.h"

namespace perdure::tools {
namespace {

using Clock = std::chrono::steady_clock;
using namespace std::chrono_literals;

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

WorldId newestWorld(const map_store::MapReader& reader) {
  const auto working = reader.working();
  return working && *working ? (*working)->world : WorldId{};
}

Result<map_store::Found> findInM(const map_store::MapReader& reader, const MapQuery& query,
                                 const WorldId& newest) {
  const auto graph = reader.graph();
  if (!graph) return tl::unexpected<Reason>(graph.error());
  const auto& records = graph->map.records;
  constexpr double kTile_m = 32.0;  // any value, because no tiles are requested
  map_store::MapInM map(reader, kTile_m, [&records](ObjectId id) {
    const auto at = records.find(id);
    return at == records.end() ? nullptr : &at->second;
  });
  const auto done = map.load(mapping::MapFrames(mapping::MapState({}, graph->map)));
  if (!done) return tl::unexpected<Reason>(done.error());
  return map.find(query, newest, query.limit);
}

}  // namespace

Result<MapReply> askMapStore(const bus::Participant& participant, MapQuery query,
                             double patience_s) {
  constexpr auto kResend = 500ms;
  bus::Writer<MapQuery> questions(participant, bus::kTopic<MapQuery>);
  bus::Reader<MapReply> answers(participant, bus::kTopic<MapReply>);
  query.client = makeInstanceId();
  query.request = 1;

  std::optional<MapReply> reply;
  bus::WaitLoop loop(participant);
  loop.on(answers, [&](const MapReply& r) {
    if (r.client == query.client && r.request == query.request) reply = r;
  });
  const auto end = Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                      std::chrono::duration<double>(patience_s));
  Clock::time_point next_send{};
  bool matched = false;
  while (!reply) {
    const auto now = Clock::now();
    if (now >= end) return fail(matched ? "no_answer" : "no_map_store");
    matched = questions.matched() > 0 && answers.matched() > 0;
    if (matched && now >= next_send) {
      (void)questions.write(query);
      next_send = now + kResend;
    }
    loop.runOnce(20ms);
  }
  return *reply;
}

MapReply askMapFile(const std::string& path, const MapQuery& query, MapFrameChoice frame) {
  const auto connection = openAtOneState(path);
  const map_store::MapReader reader(&connection);
  const WorldId newest = newestWorld(reader);
  const bool as_stored = frame == MapFrameChoice::kW || query.world.world != 0;
  auto found = read(
      path, as_stored ? reader.find(query, newest, query.limit) : findInM(reader, query, newest));
  MapReply reply;
  reply.truncated = found.truncated;
  reply.objects = std::move(found.objects);
  reply.beliefs = std::move(found.beliefs);
  return reply;
}

MapReply askGraphOfFile(const std::string& path, const MapQuery& query) {
  const auto connection = openAtOneState(path);
  const map_store::MapReader reader(&connection);
  mapping::Mapper mapper({}, read(path, reader.graph()).map);
  MapReply reply;
  map_store::putGraph(mapper, {}, newestWorld(reader), query, reply);
  return reply;
}

std::optional<GeoAnchor> earthAnchorOfMapFile(const std::string& path) {
  const auto connection = openAtOneState(path);
  const map_store::MapReader reader(&connection);
  std::istringstream numbers(read(path, reader.earthAnchor()));
  GeoAnchor anchor;
  double yaw_deg = 0.0;
  if (!(numbers >> anchor.latitude_deg >> anchor.longitude_deg >> anchor.height_m >> yaw_deg)) {
    return std::nullopt;
  }
  anchor.yaw = yaw_deg * std::numbers::pi / 180.0;
  const WorldId newest = newestWorld(reader);
  const mapping::MapFrames frames(mapping::MapState({}, read(path, reader.graph()).map));
  const auto last = frames.anchorOf(nullptr, newest, TimePoint::max());
  return frames.at(last, newest).provisional ? std::nullopt : std::optional(anchor);
}

Standing askStanding(const std::string& path, ObjectId id) {
  const auto connection = openAtOneState(path);
  const map_store::MapReader reader(&connection);
  MapQuery query;
  query.kind = MapQueryKind::kById;
  query.object_id = id;
  const auto found = read(path, reader.find(query, {}, 1));
  if (found.beliefs.empty()) {
    map_store::cannotReadMap(path, {"no_object", "it no longer has the object"});
  }
  return standingOf(found.beliefs.front(), found.objects.front().world,
                    read(path, reader.graph()).map, read(path, reader.mergedInto(id)));
}

}  // namespace perdure::tools
