#include "services/map_store/core/map_contents.h"

#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <system_error>
#include <utility>

#include "common/base/errors.h"
#include "services/map_store/core/draft_file.h"
#include "services/map_store/core/map_database.h"

namespace perdure::map_store {
namespace {

namespace fs = std::filesystem;
using mapping::Change;
using mapping::MapContents;
using mapping::Origin;
using mapping::StoredObject;

// In `provenance`, `map_first` and `map_second` identify the map of an object. They are digests of
// the first anchor, and of the first two anchors, of the map's first session. `changes` has objects
// that one drive detected and a later one reported as gone (kind 0) or moved (1). Their position is
// in the M of `map_world`.
constexpr char kFusionSchema[] = R"sql(
CREATE TABLE provenance(
  map_first INTEGER NOT NULL, map_second INTEGER NOT NULL, old_id INTEGER NOT NULL,
  id INTEGER NOT NULL, first_seen_ns INTEGER NOT NULL, last_seen_ns INTEGER NOT NULL);
CREATE INDEX provenance_by_id ON provenance(id);
CREATE TABLE changes(
  id INTEGER NOT NULL, kind INTEGER NOT NULL, class TEXT NOT NULL,
  map_world INTEGER NOT NULL, map_epoch INTEGER NOT NULL, x REAL NOT NULL, y REAL NOT NULL,
  z REAL NOT NULL, last_seen_ns INTEGER NOT NULL, since_ns INTEGER NOT NULL,
  by_world INTEGER NOT NULL, by_epoch INTEGER NOT NULL);
)sql";

WorldId worldAt(const Statement& row, int column) {
  return {row.id(column), static_cast<std::uint32_t>(row.integer(column + 1))};
}

void takeObject(const Statement& row, WholeMap& map) {
  auto belief = decodeBelief(row.blob(3));
  if (!belief || belief->id == 0) {
    ++map.malformed;
    return;
  }
  StoredObject object{worldAt(row, 0), *std::move(belief), std::nullopt};
  object.belief.visibility = Visibility::kOutOfView;
  object.belief.visible_fraction = 0.0;
  object.belief.memory = Memory::kLongTerm;
  if (row.integer(2) != 0) {
    object.ended = mapping::Ending{static_cast<EventKind>(row.integer(2) - 1),
                                   fromNanoseconds(row.integer(4)), row.id(5)};
  }
  const ObjectId id = object.belief.id;
  map.contents.objects.insert_or_assign(id, std::move(object));
}

void readObjects(const Connection& connection, WholeMap& map) {
  need(
      connection.forRows("SELECT world, epoch, gone, belief, gone_ns, "
                         "coalesce(merged_into, 0) FROM objects ORDER BY id",
                         [&](const Statement& row) { takeObject(row, map); }));
}

void readProvenance(const Connection& connection, MapContents& map) {
  if (!connection.has("provenance").value_or(false)) return;
  need(connection.forRows(
      "SELECT map_first, map_second, old_id, id, first_seen_ns, last_seen_ns FROM "
      "provenance ORDER BY rowid",
      [&](const Statement& row) {
        map.origins.push_back({{row.id(0), row.id(1)},
                               row.id(2),
                               row.id(3),
                               fromNanoseconds(row.integer(4)),
                               fromNanoseconds(row.integer(5))});
      }));
}

void readChanges(const Connection& connection, MapContents& map) {
  if (!connection.has("changes").value_or(false)) return;
  need(connection.forRows(
      "SELECT map_world, map_epoch, by_world, by_epoch, id, kind, class, x, y, z, "
      "last_seen_ns, since_ns FROM changes ORDER BY rowid",
      [&](const Statement& row) {
        Change change;
        change.map = worldAt(row, 0);
        change.by = worldAt(row, 2);
        change.id = row.id(4);
        change.kind = row.integer(5) == 1 ? Change::Kind::kMoved : Change::Kind::kGone;
        change.class_name = row.text(6);
        change.p_M = {row.real(7), row.real(8), row.real(9)};
        change.last_seen = fromNanoseconds(row.integer(10));
        change.since = fromNanoseconds(row.integer(11));
        map.changes.push_back(std::move(change));
      }));
}

void readMeta(const Connection& connection, WholeMap& map) {
  need(connection.forRows("SELECT key, value FROM meta", [&](const Statement& row) {
    if (row.text(0) == "revision") map.revision = row.id(1);
    if (row.text(0) == "tile_size_m" && row.real(1) > 0.0) map.tile_size_m = row.real(1);
    if (row.text(0) == "earth_anchor") map.earth_anchor = row.text(1);
    if (row.text(0) == "cameras") map.cameras = row.text(1);
  }));
}

WholeMap readWhole(const Connection& connection) {
  WholeMap map;
  map.schema = need(connection.integer("PRAGMA user_version"));
  auto graph = need(readGraph(connection));
  map.malformed += graph.malformed;
  map.contents.graph = std::move(graph.map);
  // In a fused map, merges are final, so each object becomes one track.
  map.contents.graph.tracks.clear();
  map.contents.graph.facts.clear();
  for (auto& [id, record] : map.contents.graph.records) {
    record.sighting.in_anchor.id = id;
    if (record.earlier) record.earlier->in_anchor.id = id;
  }
  readObjects(connection, map);
  for (Correction& correction : map.contents.graph.corrections) {
    correction.object = survivorOf(map.contents, correction.object);
    correction.other = survivorOf(map.contents, correction.other);
  }
  readProvenance(connection, map.contents);
  readChanges(connection, map.contents);
  readMeta(connection, map);
  // Removes records of objects that have no row in the map, or that are history.
  std::erase_if(map.contents.graph.records, [&](const auto& each) {
    const auto object = map.contents.objects.find(each.first);
    return object == map.contents.objects.end() || object->second.ended.has_value();
  });
  return map;
}

Batch wholeBatch(const WholeMap& map, const Objects& working, const mapping::Unsaved& graph) {
  Batch batch;
  batch.working = &working;
  batch.graph = batch.facts = &graph;
  batch.earth_anchor = map.earth_anchor;
  batch.cameras = map.cameras;
  for (const auto& [id, object] : map.contents.objects) {
    batch.left[id] = {object.world, object.belief};
    if (object.ended) {
      batch.removed[id] = {object.ended->kind, object.ended->time, object.ended->merged_into};
    }
  }
  return batch;
}

/// Returns a working set without objects. Its next_id is above the ids of the map, so that a
/// service that starts with the map assigns new ids.
Objects emptyWorkingSet(const WholeMap& map) {
  Objects working;
  const auto& anchors = map.contents.graph.anchors;
  if (!anchors.empty()) {
    const mapping::Anchor& first = anchors.begin()->second.anchor;
    working.world = first.session;
    working.stamp = first.stamp;
    working.T_WB = first.T_WA;
  }
  working.next_id = map.contents.largestId() + 1;
  return working;
}

void writeProvenance(const Connection& connection, const MapContents& map) {
  auto insert = need(connection.prepare("INSERT INTO provenance VALUES(?1, ?2, ?3, ?4, ?5, ?6)"));
  for (const Origin& origin : map.origins) {
    insert.bindAll(origin.map.first, origin.map.second, origin.id, origin.now, origin.first_seen,
                   origin.last_seen);
    need(insert.run());
  }
}

void writeChanges(const Connection& connection, const MapContents& map) {
  auto insert = need(connection.prepare(
      "INSERT INTO changes VALUES(?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11, ?12)"));
  for (const Change& change : map.changes) {
    insert.bindAll(change.id, change.kind, change.class_name, change.map.world, change.map.epoch,
                   change.p_M.x(), change.p_M.y(), change.p_M.z(), change.last_seen, change.since,
                   change.by.world, change.by.epoch);
    need(insert.run());
  }
}

/// Adds the tables that MapDatabase does not write, and moves the log's data into the file.
void completeFile(const WholeMap& map, const std::string& path) {
  const auto connection = need(Connection::open(path, Connection::Mode::kReadWriteCreate));
  auto transaction = need(Transaction::begin(connection));
  need(connection.execute(std::string(kFusionSchema) + "REPLACE INTO meta VALUES('revision', " +
                          std::to_string(static_cast<std::int64_t>(map.revision)) + ");"));
  writeProvenance(connection, map.contents);
  writeChanges(connection, map.contents);
  need(transaction.commit());
  need(connection.execute("PRAGMA journal_mode=DELETE"));
}

void writeWholeDraft(const WholeMap& map, const std::string& path, const std::string& draft,
                     std::int64_t max_size_mb) {
  const Objects working = emptyWorkingSet(map);
  mapping::Unsaved graph;
  graph.changed = map.contents.graph;
  const auto done = attempt([&] {
    need(MapDatabase({draft, map.tile_size_m, max_size_mb, false})
             .write(wholeBatch(map, working, graph)));
    completeFile(map, draft);
  });
  if (!done) cannotWriteMap(path, done.error());
}

}  // namespace

Result<WholeMap> readWholeMap(const Connection& connection) {
  return inOneState(connection, [&] { return readWhole(connection); });
}

void checkNewFile(const std::string& path, bool replace) {
  std::error_code error;
  if (fs::exists(fs::symlink_status(path)) && !replace) {
    throw StartupError(ExitCode::kConfiguration,
                       path +
                           " is there already; name another file, or give --force to replace "
                           "it.");
  }
  if (fs::is_directory(path, error)) {
    throw StartupError(ExitCode::kConfiguration, path + " is a folder; name a file in it.");
  }
  const fs::path folder = fs::absolute(path).parent_path();
  fs::create_directories(folder, error);
  if (!error && access(folder.c_str(), W_OK) != 0) error = {errno, std::generic_category()};
  if (error) cannotWriteMap(path, {"cannot_open", folder.string() + ": " + error.message()});
}

void writeWholeMap(const WholeMap& map, const std::string& path, bool replace,
                   std::int64_t max_size_mb) {
  checkNewFile(path, replace);
  const DraftFile draft(path);
  writeWholeDraft(map, path, draft.path(), max_size_mb);
  draft.keep();
}

}  // namespace perdure::map_store
