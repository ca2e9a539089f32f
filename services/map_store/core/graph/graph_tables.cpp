#include "services/map_store/core/graph/graph_tables.h"

#include <cmath>
#include <string>
#include <string_view>
#include <vector>

namespace perdure::map_store {

// core/graph/graph_codec.h encodes the blobs. Other columns repeat some of their values for
// queries. Values that change without their blob are only in columns: poses in M, held_fast,
// weight. These columns have no type, because REAL would lose the sign of zero.
const char* const kGraphSchema = R"sql(
CREATE TABLE graph_classes(number INTEGER PRIMARY KEY, name TEXT NOT NULL);
CREATE TABLE anchors(
  id INTEGER PRIMARY KEY, previous INTEGER NOT NULL, world INTEGER NOT NULL,
  epoch INTEGER NOT NULL, source INTEGER NOT NULL, sequence INTEGER NOT NULL,
  time_ns INTEGER NOT NULL, way_m REAL NOT NULL, anchor BLOB NOT NULL);
CREATE TABLE anchor_poses(
  id INTEGER PRIMARY KEY, x NOT NULL, y NOT NULL, z NOT NULL, yaw NOT NULL,
  held_fast INTEGER NOT NULL);
CREATE TABLE edges(
  id INTEGER PRIMARY KEY, a INTEGER NOT NULL, b INTEGER NOT NULL, kind INTEGER NOT NULL,
  weight NOT NULL, edge BLOB NOT NULL);
CREATE TABLE sightings(
  id INTEGER PRIMARY KEY, anchor INTEGER NOT NULL, world INTEGER NOT NULL, epoch INTEGER NOT NULL,
  last_seen_ns INTEGER NOT NULL, x REAL NOT NULL, y REAL NOT NULL, z REAL NOT NULL,
  yaw REAL NOT NULL, record BLOB NOT NULL);
CREATE VIEW objects_in_map AS
  SELECT id, class, x, y, z, turn - pi() * ceil(turn / pi() - 0.5) AS yaw FROM (
    SELECT o.id AS id, o.class AS class,
      p.x + cos(p.yaw) * s.x - sin(p.yaw) * s.y AS x,
      p.y + sin(p.yaw) * s.x + cos(p.yaw) * s.y AS y,
      p.z + s.z AS z, p.yaw + s.yaw AS turn
    FROM objects o JOIN sightings s ON s.id = o.id JOIN anchor_poses p ON p.id = s.anchor
    WHERE o.gone = 0);
)sql";

const char* const kAddedSchema = R"sql(
CREATE TABLE IF NOT EXISTS views(anchor INTEGER PRIMARY KEY, points BLOB NOT NULL);
CREATE TABLE IF NOT EXISTS same(
  loop INTEGER NOT NULL, a INTEGER NOT NULL, b INTEGER NOT NULL, PRIMARY KEY(loop, a, b))
  WITHOUT ROWID;
CREATE TABLE IF NOT EXISTS track_sightings(
  id INTEGER PRIMARY KEY, confirmed INTEGER NOT NULL, gone INTEGER NOT NULL, record BLOB NOT NULL);
CREATE TABLE IF NOT EXISTS tracks(
  id INTEGER PRIMARY KEY, world INTEGER NOT NULL, epoch INTEGER NOT NULL,
  written INTEGER NOT NULL, gone INTEGER NOT NULL, gone_ns INTEGER, belief BLOB NOT NULL);
CREATE TABLE IF NOT EXISTS corrections(
  id INTEGER PRIMARY KEY, kind INTEGER NOT NULL, object INTEGER NOT NULL, other INTEGER NOT NULL,
  class TEXT NOT NULL, nats REAL NOT NULL, author TEXT NOT NULL, time_ns INTEGER NOT NULL,
  withdrawn INTEGER NOT NULL);
DROP TABLE IF EXISTS merges;
)sql";

namespace {

constexpr char kPutAnchor[] =
    "INSERT INTO anchors VALUES(?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9) ON CONFLICT(id) DO UPDATE SET "
    "previous = ?2, world = ?3, epoch = ?4, source = ?5, sequence = ?6, time_ns = ?7, way_m = ?8, "
    "anchor = ?9 WHERE anchor <> ?9";
constexpr char kPutPose[] = "REPLACE INTO anchor_poses VALUES(?1, ?2, ?3, ?4, ?5, ?6)";
constexpr char kPutEdge[] = "REPLACE INTO edges VALUES(?1, ?2, ?3, ?4, ?5, ?6)";
constexpr char kPutSighting[] =
    "REPLACE INTO sightings VALUES(?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10)";
constexpr char kPutTrack[] = "REPLACE INTO track_sightings VALUES(?1, ?2, ?3, ?4)";
constexpr char kPutFact[] = "REPLACE INTO same VALUES(?1, ?2, ?3)";
constexpr char kDeleteFact[] = "DELETE FROM same WHERE loop = ?1 AND a = ?2 AND b = ?3";
constexpr char kPutCorrection[] =
    "REPLACE INTO corrections VALUES(?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9)";
constexpr char kPutView[] = "REPLACE INTO views VALUES(?1, ?2)";
constexpr char kPutClass[] =
    "INSERT INTO graph_classes VALUES(?1, ?2) ON CONFLICT(number) DO UPDATE SET name = ?2 "
    "WHERE name <> ?2";

/// Runs `sql` for each element of `all`; `bind` binds the element to the parameters.
template <class All, class Bind>
void runForEach(const Connection& connection, std::string_view sql, const All& all, Bind bind) {
  if (all.empty()) return;
  auto statement = need(connection.prepare(sql));
  for (const auto& each : all) {
    bind(statement, each);
    need(statement.run());
  }
}

using AnchorRow = std::pair<const mapping::AnchorId, mapping::SavedAnchor>;
using EdgeRow = std::pair<const mapping::EdgeId, mapping::SavedEdge>;
using ViewRow = std::pair<const mapping::AnchorId, mapping::View>;
using SightingRow = std::pair<const ObjectId, mapping::ObjectRecord>;

void bindAnchor(Statement& to, const AnchorRow& row) {
  const mapping::Anchor& anchor = row.second.anchor;
  to.bindAll(row.first, anchor.previous, anchor.session.world, anchor.session.epoch,
             anchor.stamp.source, anchor.stamp.sequence, anchor.stamp.time, anchor.way_m,
             encodeAnchor(anchor));
}

void bindPose(Statement& to, const AnchorRow& row) {
  const mapping::LevelPose& T_MA = row.second.T_MA;
  to.bindAll(row.first, T_MA.p.x(), T_MA.p.y(), T_MA.p.z(), T_MA.yaw, row.second.held_fast);
}

void bindEdge(Statement& to, const EdgeRow& row) {
  const mapping::Edge& edge = row.second.edge;
  to.bindAll(row.first, edge.a, edge.b, edge.kind, row.second.weight, encodeEdge(edge));
}

void bindSighting(Statement& to, const SightingRow& row) {
  const mapping::ObjectRecord& record = row.second;
  const mapping::PlacedObject& object = record.sighting.in_anchor;
  to.bindAll(row.first, record.sighting.anchor, record.session.world, record.session.epoch,
             record.last_seen, object.p.x(), object.p.y(), object.p.z(), object.yaw,
             encodeRecord(record));
}

void bindTrack(Statement& to, const SightingRow& row) {
  to.bindAll(row.first, row.second.confirmed, row.second.gone, encodeRecord(row.second));
}

void bindFact(Statement& to, const mapping::SameObject& fact) {
  to.bindAll(fact.loop, fact.a, fact.b);
}

void bindCorrection(Statement& to, const Correction& c) {
  to.bindAll(c.id, c.kind, c.object, c.other, c.class_name, c.nats, c.author, c.time, c.withdrawn);
}

void bindView(Statement& to, const ViewRow& row) { to.bindAll(row.first, encodeView(row.second)); }

/// Returns the elements of `all` that may be written. Adds the number of the others to `refused`.
template <class All, class MayBeWritten>
std::vector<std::reference_wrapper<const typename All::value_type>> soundOnes(
    const All& all, std::uint64_t& refused, MayBeWritten mayBeWritten) {
  std::vector<std::reference_wrapper<const typename All::value_type>> sound;
  for (const auto& each : all) {
    if (mayBeWritten(each.second)) {
      sound.emplace_back(each);
    } else {
      ++refused;
    }
  }
  return sound;
}

void putClasses(const Connection& connection, const std::vector<std::string>& classes) {
  std::int64_t next = 0;
  runForEach(connection, kPutClass, classes,
             [&](Statement& to, const std::string& name) { to.bindAll(next++, name); });
}

void deleteFrom(const Connection& connection, const std::string& table,
                const std::set<std::uint64_t>& ids, const std::string& key = "id") {
  runForEach(connection, "DELETE FROM " + table + " WHERE " + key + " = ?1", ids,
             [](Statement& to, std::uint64_t id) { to.bind(1, id); });
}

/// Deletes the rows of a table whose ids are not in `known`.
template <class Known>
void deleteOthers(const Connection& connection, const std::string& table, const Known& known,
                  const std::string& key = "id") {
  std::set<std::uint64_t> others;
  need(connection.forRows("SELECT " + key + " FROM " + table, [&](const auto& row) {
    if (!known.contains(row.id(0))) others.insert(row.id(0));
  }));
  deleteFrom(connection, table, others, key);
}

}  // namespace

std::uint64_t writeGraph(const Connection& connection, const mapping::Unsaved& unsaved) {
  const mapping::SavedMap& changed = unsaved.changed;
  std::uint64_t refused = 0;
  const auto anchors = soundOnes(changed.anchors, refused, [](const mapping::SavedAnchor& saved) {
    return isSound(saved.anchor) && isSound(saved.T_MA);
  });
  const auto edges = soundOnes(changed.edges, refused, [](const mapping::SavedEdge& saved) {
    return isSound(saved.edge) && std::isfinite(saved.weight);
  });
  std::uint64_t unconfirmed = 0;
  const auto records = soundOnes(changed.records, refused, [&](const mapping::ObjectRecord& r) {
    unconfirmed += r.confirmed ? 0 : 1;
    return r.confirmed && isSound(r);
  });
  const auto tracks = soundOnes(
      changed.tracks, refused, [](const mapping::ObjectRecord& record) { return isSound(record); });
  const auto views =
      soundOnes(changed.views, refused, [](const mapping::View& view) { return isSound(view); });
  putClasses(connection, changed.classes);
  deleteFrom(connection, "edges", unsaved.edges_gone);
  deleteFrom(connection, "sightings", unsaved.records_gone);
  runForEach(connection, kPutAnchor, anchors, bindAnchor);
  runForEach(connection, kPutPose, anchors, bindPose);
  runForEach(connection, kPutEdge, edges, bindEdge);
  runForEach(connection, kPutSighting, records, bindSighting);
  deleteFrom(connection, "track_sightings", unsaved.tracks_gone);
  runForEach(connection, kPutTrack, tracks, bindTrack);
  runForEach(connection, kPutView, views, bindView);
  return refused - unconfirmed;
}

void writeFacts(const Connection& connection, const mapping::Unsaved& unsaved) {
  runForEach(connection, kDeleteFact, unsaved.facts_gone, bindFact);
  runForEach(connection, kPutFact, unsaved.changed.facts, bindFact);
  runForEach(connection, kPutCorrection, unsaved.changed.corrections, bindCorrection);
}

void sweepGraph(const Connection& connection) {
  const SavedGraph whole = need(readGraph(connection));
  if (whole.malformed == 0) return;
  const mapping::SavedMap& map = whole.map;
  mapping::Unsaved shortened;
  for (const ObjectId id : whole.shortened) shortened.changed.records[id] = map.records.at(id);
  shortened.changed.tracks = map.tracks;
  shortened.changed.facts = map.facts;
  need(connection.execute("DELETE FROM graph_classes WHERE number < 0 OR number >= " +
                          std::to_string(map.classes.size())));
  deleteOthers(connection, "anchors", map.anchors);
  deleteOthers(connection, "anchor_poses", map.anchors);
  deleteOthers(connection, "edges", map.edges);
  deleteOthers(connection, "sightings", map.records);
  deleteOthers(connection, "track_sightings", map.tracks);
  deleteOthers(connection, "views", map.views, "anchor");
  need(connection.execute("DELETE FROM same"));
  writeFacts(connection, shortened);
  (void)writeGraph(connection, shortened);
}

}  // namespace perdure::map_store
