#include <algorithm>
#include <cmath>
#include <string>

#include "services/map_store/core/map_database.h"

namespace perdure::map_store {
namespace {

constexpr char kColumns[] = "SELECT o.world, o.epoch, o.visibility, o.memory, o.belief ";
constexpr char kInBox[] =
    "FROM positions p JOIN objects o ON o.id = p.id WHERE p.x1 >= ?1 AND p.x0 <= ?2 AND "
    "p.y1 >= ?3 AND p.y0 <= ?4 AND p.z1 >= ?5 AND p.z0 <= ?6 AND "
    "o.world = ?7 AND o.epoch = ?8 AND o.gone = 0 ";

Result<PlacedBelief> beliefFrom(const Statement& row) {
  auto belief = decodeBelief(row.blob(4));
  if (!belief) return tl::unexpected<Reason>(belief.error());
  belief->visibility = static_cast<Visibility>(std::clamp<std::int64_t>(row.integer(2), 0, 4));
  belief->memory = row.integer(3) == 0 ? Memory::kWorking : Memory::kLongTerm;
  return PlacedBelief{{row.id(0), static_cast<std::uint32_t>(row.integer(1))}, std::move(*belief)};
}

constexpr char kPlace[] =
    "SELECT id, world, epoch, x, y, z, last_seen_ns FROM objects WHERE gone = 0 ";

StoredPlace placeFrom(const Statement& row) {
  return {row.id(0),
          {row.id(1), static_cast<std::uint32_t>(row.integer(2))},
          {row.real(3), row.real(4), row.real(5)},
          fromNanoseconds(row.integer(6))};
}

void bindBox(Statement& statement, const Eigen::Vector3d& low, const Eigen::Vector3d& high,
             const WorldId& world) {
  for (int axis = 0; axis < 3; ++axis) {
    statement.bind(1 + 2 * axis, low[axis]).bind(2 + 2 * axis, high[axis]);
  }
  statement.bind(7, world.world).bind(8, world.epoch);
}

Result<Statement> byBox(const Connection& connection, const MapQuery& query, const WorldId& world) {
  // The tree's bounds have single precision and enclose the points, so the exact columns are
  // compared too.
  auto statement = connection.prepare(std::string(kColumns) + kInBox +
                                      "AND o.x BETWEEN ?1 AND ?2 AND o.y BETWEEN ?3 AND ?4 AND "
                                      "o.z BETWEEN ?5 AND ?6 ORDER BY o.id");
  if (statement) bindBox(*statement, query.low, query.high, world);
  return statement;
}

Result<Statement> byRadius(const Connection& connection, const MapQuery& query,
                           const WorldId& world) {
  constexpr char kSquaredDistance[] =
      "((o.x - ?9) * (o.x - ?9) + (o.y - ?10) * (o.y - ?10) + (o.z - ?11) * (o.z - ?11))";
  auto statement = connection.prepare(std::string(kColumns) + kInBox + "AND " + kSquaredDistance +
                                      " <= ?12 ORDER BY " + kSquaredDistance + ", o.id");
  if (!statement) return statement;
  const Eigen::Vector3d reach = Eigen::Vector3d::Constant(query.radius);
  bindBox(*statement, query.low - reach, query.low + reach, world);
  for (int axis = 0; axis < 3; ++axis) statement->bind(9 + axis, query.low[axis]);
  statement->bind(12, query.radius * query.radius);
  return statement;
}

/// Returns the ids, separated by commas, of objects whose class a correction may have changed.
std::string correctedIds(const CorrectionsOf* corrections) {
  std::string ids;
  if (corrections == nullptr) return ids;
  for (const auto& [id, all] : *corrections) {
    ids += (ids.empty() ? "" : ",") + std::to_string(static_cast<std::int64_t>(id));
  }
  return ids;
}

}  // namespace

Result<Statement> MapReader::statementFor(const MapQuery& query, const WorldId& world) const {
  const Connection& connection = *connection_;
  const std::string from = std::string(kColumns) + "FROM objects o WHERE o.gone = 0 ";
  switch (query.kind) {
    case MapQueryKind::kById: {
      auto statement = connection.prepare(from + "AND o.id = ?1");
      if (statement) statement->bind(1, query.object_id);
      return statement;
    }
    case MapQueryKind::kByClass: {
      auto statement = connection.prepare(from + "AND (o.class = ?1 OR o.id IN (" +
                                          correctedIds(corrections_) + ")) ORDER BY o.id");
      if (statement) statement->bind(1, query.class_name);
      return statement;
    }
    case MapQueryKind::kByRadius:
      return byRadius(connection, query, world);
    case MapQueryKind::kByBox:
      return byBox(connection, query, world);
    case MapQueryKind::kAll:
      return connection.prepare(from + "ORDER BY o.id");
    case MapQueryKind::kRestore:
    case MapQueryKind::kGraph:
      break;
  }
  return fail("query_invalid", "a restore or the graph is no question about objects");
}

/// Reads at most `limit` rows. Reads one more row to set `truncated`. Objects of another class than
/// that of a kByClass query are left out.
Result<Found> MapReader::collect(Statement& statement, std::size_t limit,
                                 const MapQuery& query) const {
  Found found;
  for (;;) {
    const auto row = statement.step();
    if (!row) return tl::unexpected<Reason>(row.error());
    if (!*row) return found;
    auto placed = beliefFrom(statement);
    if (placed && corrections_ != nullptr) correct(*corrections_, placed->belief);
    const bool by_class = query.kind == MapQueryKind::kByClass;
    if (placed && by_class && placed->belief.best().name != query.class_name) continue;
    if (found.objects.size() == limit) {
      found.truncated = true;
      statement.reset();
      return found;
    }
    if (placed) {
      found.objects.push_back(mapObjectOf(placed->belief, placed->world));
      if (query.kind == MapQueryKind::kById) found.beliefs.push_back(std::move(placed->belief));
    } else {
      ++found.malformed;
    }
  }
}

namespace {

/// Returns the beliefs of the working set. Those of confirmed tracks are in `tracks` or `objects`.
std::vector<ObjectBelief> workingBeliefs(const Connection& connection) {
  const bool has_tracks = need(connection.has("tracks"));  // older maps have no such table
  std::vector<ObjectBelief> beliefs;
  need(connection.forRows(
      has_tracks ? "SELECT coalesce(w.belief, t.belief, o.belief) FROM working w "
                   "LEFT JOIN tracks t ON t.id = w.id LEFT JOIN objects o ON o.id = w.id "
                   "ORDER BY w.position"
                 : "SELECT coalesce(w.belief, o.belief) FROM working w "
                   "LEFT JOIN objects o ON o.id = w.id ORDER BY w.position",
      [&](const Statement& row) {
        if (auto belief = decodeBelief(row.blob(0))) beliefs.push_back(std::move(*belief));
      }));
  return beliefs;
}

}  // namespace

std::optional<Square> squareOf(const Eigen::Vector3d& p, double tile_size_m) {
  constexpr double kFarthest = 1e9;
  if (!p.allFinite() || p.cwiseAbs().maxCoeff() > kFarthest * std::min(1.0, tile_size_m)) {
    return std::nullopt;
  }
  return Square{static_cast<std::int32_t>(std::floor(p.x() / tile_size_m)),
                static_cast<std::int32_t>(std::floor(p.y() / tile_size_m))};
}

MapObject mapObjectOf(const ObjectBelief& belief, const WorldId& world) {
  MapObject object;
  object.id = belief.id;
  object.world = world;
  object.class_name = belief.best().name;
  object.existence = belief.existence;
  object.class_probability = belief.best().probability;
  object.mean = belief.best().mean;
  object.covariance = belief.best().covariance;
  object.first_seen = belief.first_seen;
  object.last_seen = belief.last_seen;
  object.hits = belief.hits;
  object.visibility = belief.visibility;
  object.memory = belief.memory;
  return object;
}

std::vector<Correction> MapReader::correctionsFor(const MapQuery& query) const {
  const bool all = query.kind == MapQueryKind::kAll;
  std::map<std::uint64_t, Correction> by_id;  // one about two objects is listed twice
  if (corrections_ == nullptr || (!all && query.kind != MapQueryKind::kById)) return {};
  for (const auto& [object, of_object] : *corrections_) {
    if (!all && object != query.object_id) continue;
    for (const Correction& each : of_object) by_id[each.id] = each;
  }
  std::vector<Correction> result;
  for (auto& [id, correction] : by_id) result.push_back(std::move(correction));
  return result;
}

Result<Found> MapReader::find(const MapQuery& query, const WorldId& newest,
                              std::uint32_t limit) const {
  const WorldId world = query.world.world != 0 ? query.world : newest;
  return statementFor(query, world).and_then([&](Statement statement) {
    auto found = collect(statement, limit, query);
    if (found) found->corrections = correctionsFor(query);
    return found;
  });
}

Result<std::vector<PlacedBelief>> MapReader::beliefs() const {
  std::vector<PlacedBelief> beliefs;
  const auto read =
      connection_->forRows(std::string(kColumns) + "FROM objects o WHERE o.gone = 0 ORDER BY o.id",
                           [&](const Statement& row) {
                             auto placed = beliefFrom(row);
                             if (!placed) return;
                             if (corrections_ != nullptr) correct(*corrections_, placed->belief);
                             beliefs.push_back(std::move(*placed));
                           });
  return read.map([&] { return std::move(beliefs); });
}

Result<std::vector<EndedObject>> MapReader::ended() const {
  std::vector<EndedObject> ended;
  const auto take = [&](const Statement& row) {
    auto placed = beliefFrom(row);
    if (!placed) return;
    ended.push_back({std::move(*placed),
                     {static_cast<EventKind>(std::clamp<std::int64_t>(
                          row.integer(5) - 1, 0, static_cast<int>(EventKind::kRelocalised))),
                      fromNanoseconds(row.integer(6)), row.id(7)}});
  };
  return connection_
      ->forRows(std::string(kColumns) +
                    ", o.gone, o.gone_ns, coalesce(o.merged_into, 0) FROM objects o "
                    "WHERE o.gone <> 0 ORDER BY o.gone_ns, o.id",
                take)
      .map([&] { return std::move(ended); });
}

Result<Found> MapReader::inFullNear(const Eigen::Vector3d& centre, double radius,
                                    const WorldId& world, std::uint32_t limit) const {
  MapQuery query;
  query.low = centre;
  query.radius = radius;
  return byRadius(*connection_, query, world).and_then([&](Statement statement) {
    query.kind = MapQueryKind::kById;  // in full
    return MapReader(connection_).collect(statement, limit, query);
  });
}

Result<std::optional<PlacedBelief>> MapReader::beliefOf(TrackId track) const {
  return attempt([&] {
    return need(connection_->first(
        "SELECT world, epoch, 0, 0, belief FROM tracks WHERE id = ?1 AND gone = 0 UNION ALL "
        "SELECT world, epoch, visibility, memory, belief FROM objects WHERE id = ?1 AND gone = 0 "
        "AND NOT EXISTS (SELECT 1 FROM tracks WHERE id = ?1) LIMIT 1",
        [](const Statement& row) { return need(beliefFrom(row)); }, track));
  });
}

Result<Found> MapReader::byIds(const std::vector<ObjectId>& ids, std::size_t limit) const {
  auto statement =
      connection_->prepare(std::string(kColumns) + "FROM objects o WHERE o.id = ?1 AND o.gone = 0");
  if (!statement) return tl::unexpected<Reason>(statement.error());
  Found found;
  for (const ObjectId id : ids) {
    statement->bind(1, id);
    auto one = collect(*statement, 1);
    if (!one) return one;
    found.truncated = found.objects.size() == limit && !one->objects.empty();
    if (found.truncated) return found;
    found.malformed += one->malformed;
    for (MapObject& object : one->objects) found.objects.push_back(std::move(object));
    statement->reset();
  }
  return found;
}

Result<std::vector<StoredPlace>> MapReader::places() const {
  std::vector<StoredPlace> places;
  return connection_
      ->forRows(std::string(kPlace) + "ORDER BY id",
                [&](const Statement& row) { places.push_back(placeFrom(row)); })
      .map([&] { return std::move(places); });
}

Result<std::optional<StoredPlace>> MapReader::placeOf(ObjectId id) const {
  return connection_->first(std::string(kPlace) + "AND id = ?1", placeFrom, id);
}

Result<std::vector<ObjectId>> MapReader::mergedInto(ObjectId id) const {
  std::vector<ObjectId> ids;
  return connection_
      ->forRows(
          "SELECT id FROM objects WHERE merged_into = ?1 ORDER BY id",
          [&](const Statement& row) { ids.push_back(row.id(0)); }, id)
      .map([&] { return std::move(ids); });
}

Result<std::optional<Objects>> MapReader::working() const {
  return attempt([&] {
    auto working = need(
        connection_->first("SELECT value FROM meta WHERE key = 'working'",
                           [](const Statement& row) { return need(decodeHeader(row.blob(0))); }));
    if (working) working->objects = workingBeliefs(*connection_);
    return working;
  });
}

Result<std::set<std::uint64_t>> MapReader::worlds() const {
  return attempt([&] {
    const bool has_graph = need(connection_->has("anchors"));
    std::set<std::uint64_t> worlds;
    need(connection_->forRows(std::string("SELECT DISTINCT world FROM objects") +
                                  (has_graph ? " UNION SELECT world FROM anchors" : ""),
                              [&](const Statement& row) { worlds.insert(row.id(0)); }));
    if (const auto last = need(working())) worlds.insert(last->world.world);
    return worlds;
  });
}

Result<std::set<std::string>> MapReader::classes() const {
  return attempt([&] {
    const bool has_graph = need(connection_->has("graph_classes"));
    std::set<std::string> classes;
    need(connection_->forRows(std::string("SELECT DISTINCT class FROM objects") +
                                  (has_graph ? " UNION SELECT name FROM graph_classes" : ""),
                              [&](const Statement& row) { classes.insert(row.text(0)); }));
    return classes;
  });
}

Result<std::string> MapReader::meta(std::string_view key) const {
  return connection_
      ->first(
          "SELECT value FROM meta WHERE key = ?1", [](const Statement& row) { return row.text(0); },
          key)
      .map([](auto value) { return std::move(value).value_or(""); });
}

Result<std::uint64_t> MapReader::revision() const {
  return connection_->integer(
      "SELECT coalesce((SELECT value FROM meta WHERE key = 'revision'), 0)");
}

Result<ObjectId> MapReader::largestId() const {
  return connection_->integer("SELECT coalesce(max(id), 0) FROM objects");
}

}  // namespace perdure::map_store
