#include "services/map_store/core/map_database.h"

#include <cmath>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>

#include "common/base/check.h"
#include "common/base/errors.h"
#include "services/map_store/core/outbox.h"
#include "services/map_store/core/track_rows.h"

namespace perdure::map_store {
namespace {

constexpr char kPutObject[] =
    "REPLACE INTO objects(id, world, epoch, class, class_probability, existence, x, y, z, yaw, "
    "length, width, height, first_seen_ns, last_seen_ns, hits, visibility, memory, tile_x, tile_y, "
    "belief) VALUES(?1,?2,?3,?4,?5,?6,?7,?8,?9,?10,?11,?12,?13,?14,?15,?16,?17,?18,?19,?20,?21)";

std::uint64_t digestOf(std::span<const std::uint8_t> bytes, const WorldId& world) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  return digest(text) ^ (world.world * 31 + world.epoch);
}

/// Runs a statement that a commit uses for many rows. The first call prepares it.
void runAgain(const Connection& connection, std::optional<Statement>& statement,
              std::string_view sql, const auto&... parameters) {
  if (!statement) statement.emplace(need(connection.prepare(sql)));
  need(statement->bindAll(parameters...).run());
}

}  // namespace

struct MapDatabase::Change {
  std::set<ObjectId> objects;    ///< objects whose rows have changed
  std::map<TrackId, Row> rows;   ///< rows of `committed_` after the commit
  std::set<TrackId> shut_out;    ///< tracks that were removed at or after the time of this frame
  std::set<TrackId> alive;       ///< tracks of the working set
  std::set<ObjectId> to_derive;  ///< objects whose rows must be computed from their tracks
  std::uint64_t revision = 0;    ///< revision of this commit
  std::optional<Statement> put_object, put_place;
};

namespace {

bool isShared(TrackId track, const Batch& batch) {
  return batch.identity != nullptr && batch.identity->isShared(track);
}

}  // namespace

MapDatabase::MapDatabase(const StoreOptions& options) : MapDatabase(openStore(options), options) {}

MapDatabase::MapDatabase(OpenedStore opened, const StoreOptions& options)
    : connection_(std::move(opened.connection)),
      notice_(std::move(opened.notice)),
      tile_size_m_(options.tile_size_m) {
  const auto ready = attempt([&] {
    keepTileSize();
    rememberWorking();
    options.outbox ? openOutbox(connection_) : dropOutbox(connection_);
  });
  if (!ready) {
    throw StartupError(ExitCode::kUnavailable,
                       "The map " + options.path + " cannot be read (" + ready.error().detail +
                           "); free the disk or set store.path to another file.");
  }
}

/// Updates the columns tile_x and tile_y to the configured tile size.
void MapDatabase::keepTileSize() {
  const std::string size = std::to_string(tile_size_m_);
  const auto same = need(connection_.first(
      "SELECT value FROM meta WHERE key = 'tile_size_m' AND value = ?1",
      [](const Statement& row) { return row.text(0); }, size));
  if (same) return;
  auto transaction = need(Transaction::begin(connection_));
  retile();
  need(connection_.run("REPLACE INTO meta VALUES('tile_size_m', ?1)", size));
  need(transaction.commit());
}

void MapDatabase::retile() {
  auto update =
      need(connection_.prepare("UPDATE objects SET tile_x = ?2, tile_y = ?3 WHERE id = ?1"));
  need(connection_.forRows("SELECT id, x, y FROM objects", [&](const Statement& row) {
    const auto square = squareOf({row.real(1), row.real(2), 0.0}, tile_size_m_);
    if (square) need(update.bindAll(row.integer(0), square->x, square->y).run());
  }));
}

void MapDatabase::rememberWorking() {
  need(
      connection_.forRows("SELECT id FROM working WHERE belief IS NULL",
                          [&](const Statement& row) { committed_[row.id(0)] = rowOf(row.id(0)); }));
}

MapDatabase::Row MapDatabase::rowOf(ObjectId id) const {
  Row row;
  const auto take = [&](const Statement& stored) {
    row.stored = true;
    if (stored.integer(0) != 0) row.gone = fromNanoseconds(stored.integer(1));
    const WorldId world{stored.id(3), static_cast<std::uint32_t>(stored.integer(4))};
    // Without a digest, a track that had left the working set is written again even if its belief
    // is the same.
    if (stored.integer(2) == 0) row.digest = digestOf(stored.blob(5), world);
  };
  need(connection_.forRows(
      "SELECT gone, gone_ns, memory, world, epoch, belief FROM objects WHERE id = ?1", take, id));
  return row;
}

MapDatabase::Row MapDatabase::rowOfTrack(TrackId id, const Batch& batch) const {
  const auto known = committed_.find(id);
  if (known != committed_.end()) return known->second;
  if (!isShared(id, batch)) return rowOf(id);
  const auto track = readTrack(connection_, id);
  return track ? Row{0, true, track->gone} : Row{};
}

void MapDatabase::insert(const PlacedBelief& placed, const Square& square, const Bytes& bytes,
                         Change& change) {
  const MapObject o = mapObjectOf(placed.belief, placed.world);
  const Vector7d& m = o.mean;
  runAgain(connection_, change.put_object, kPutObject, o.id, o.world.world, o.world.epoch,
           o.class_name, o.class_probability, o.existence, m[0], m[1], m[2], m[3], std::exp(m[4]),
           std::exp(m[5]), std::exp(m[6]), o.first_seen, o.last_seen, o.hits, o.visibility,
           o.memory, square.x, square.y, bytes);
  runAgain(connection_, change.put_place,
           "REPLACE INTO positions VALUES(?1, ?2, ?3, ?4, ?5, ?6, ?7)", o.id, m[0], m[0], m[1],
           m[1], m[2], m[2]);
}

void MapDatabase::put(const PlacedBelief& placed, const Batch& batch, Change& change) {
  const TrackId id = placed.belief.id;
  const auto square = squareOf(placed.belief.best().mean.head<3>(), tile_size_m_);
  if (!square) throw Failed{{"object_invalid", "an object's centre is not a place on the map"}};
  const Row before = rowOfTrack(id, batch);
  if (before.gone && *before.gone >= batch.working->stamp.time) {
    change.shut_out.insert(id);
    return;
  }
  const Bytes bytes = encodeBelief(placed.belief);
  const Row after{digestOf(bytes, placed.world), true, std::nullopt};
  change.rows[id] = after;
  if (after.digest == before.digest) return;
  if (isShared(id, batch)) {
    change.to_derive.insert(batch.identity->objectOf(id));
    return writeTrack(connection_, {id, placed, change.revision, std::nullopt});
  }
  change.objects.insert(id);
  insert(placed, *square, bytes, change);
}

void MapDatabase::putObjects(const Batch& batch, Change& change) {
  for (const auto& [id, placed] : batch.left) put(placed, batch, change);
  for (const auto& belief : batch.working->objects) {
    if (!belief.confirmed || batch.placed.contains(belief.id)) continue;
    put({batch.working->world, belief}, batch, change);
  }
}

/// Moves the rows of tracks that begin or cease to share an object.
void MapDatabase::regroup(const Batch& batch, Change& change) {
  for (const TrackId id : batch.regrouped) {
    committed_.erase(id);
    if (isShared(id, batch)) {
      change.to_derive.insert(batch.identity->objectOf(id));
      shareTrack(connection_, id);
      continue;
    }
    const auto track = readTrack(connection_, id);
    if (!track) continue;
    deleteTrack(connection_, id);
    const PlacedBelief& placed = track->placed;
    const auto square = squareOf(placed.belief.best().mean.head<3>(), tile_size_m_);
    if (square) insert(placed, *square, encodeBelief(placed.belief), change);
    change.objects.insert(id);
    if (track->gone) remove(id, {EventKind::kGone, *track->gone, 0}, change);
    if (!change.alive.contains(id)) markLeft(id, change);
  }
}

/// Makes the row of a track whose id is not its object's id history. The row has the last belief of
/// this track.
void MapDatabase::hide(const StoredTrack* track, TrackId id, ObjectId object, TimePoint time,
                       Change& change) {
  const Row row = rowOf(id);
  if (row.gone) {
    return need(connection_.run(
        "UPDATE objects SET merged_into = ?2 WHERE id = ?1 AND merged_into <> ?2", id, object));
  }
  if (row.stored && track != nullptr) {
    const PlacedBelief& placed = track->placed;
    const auto square = squareOf(placed.belief.best().mean.head<3>(), tile_size_m_);
    if (square) insert(placed, *square, encodeBelief(placed.belief), change);
  }
  remove(id, {EventKind::kMerged, time, object}, change);
}

/// Writes the row of an object from that of its newest track: one of the working set, else the one
/// of this W that was detected last, else the one that was written last. The object is gone if that
/// track is gone.
void MapDatabase::derive(ObjectId object, const Batch& batch, Change& change) {
  std::optional<StoredTrack> newest;
  const auto rank = [&](const StoredTrack& track) {
    const bool here = track.placed.world == batch.working->world;
    return std::tuple(change.alive.contains(track.id), here,
                      here ? track.placed.belief.last_seen : TimePoint(), track.written, track.id);
  };
  for (const TrackId id : batch.identity->tracksOf(object)) {
    auto track = readTrack(connection_, id);
    if (id != object) {
      hide(track ? &*track : nullptr, id, object, batch.working->stamp.time, change);
    }
    if (track && (!newest || rank(*track) > rank(*newest))) newest = std::move(track);
  }
  if (!newest) return;
  if (newest->gone) return remove(object, {EventKind::kGone, *newest->gone, 0}, change);
  newest->placed.belief.id = object;
  const auto square = squareOf(newest->placed.belief.best().mean.head<3>(), tile_size_m_);
  if (!square) return;
  change.objects.insert(object);
  insert(newest->placed, *square, encodeBelief(newest->placed.belief), change);
  if (!change.alive.contains(newest->id)) markLeft(object, change);
}

void MapDatabase::end(TrackId id, const Removal& removal, const Batch& batch, Change& change) {
  if (!isShared(id, batch)) return remove(id, removal, change);
  change.rows.erase(id);
  change.to_derive.insert(batch.identity->objectOf(id));
  // The surviving track contains the information of a merged one.
  if (removal.kind == EventKind::kMerged) return deleteTrack(connection_, id);
  endTrack(connection_, id, removal.time);
}

/// Adds the tracks of the stored working set whose belief is not in a row of the map, because they
/// may have a row from when they were confirmed.
void MapDatabase::addDoubtful(std::set<ObjectId>& ids) const {
  need(connection_.forRows("SELECT id FROM working WHERE belief IS NOT NULL",
                           [&](const Statement& row) { ids.insert(row.id(0)); }));
}

void MapDatabase::markLeft(ObjectId id, Change& change) {
  const Row row = rowOf(id);
  if (!row.stored || row.gone) return;
  change.objects.insert(id);
  need(connection_.run("UPDATE objects SET visibility = ?2, memory = ?3 WHERE id = ?1", id,
                       Visibility::kOutOfView, Memory::kLongTerm));
}

void MapDatabase::remove(ObjectId id, const Removal& removal, Change& change) {
  const Row row = rowOf(id);
  if (!row.stored || row.gone) return;  // never confirmed, or gone before
  change.objects.insert(id);
  change.rows.erase(id);
  need(connection_.run(
      "UPDATE objects SET gone = ?2, gone_ns = ?3, merged_into = nullif(?4, 0) WHERE id = ?1", id,
      1 + static_cast<std::int64_t>(removal.kind), removal.time, removal.merged_into));
  need(connection_.run("DELETE FROM positions WHERE id = ?1", id));
  need(connection_.run("DELETE FROM sightings WHERE id = ?1", id));
}

void MapDatabase::putWorking(const Objects& working, const Change& change) {
  need(connection_.run("REPLACE INTO meta VALUES('working', ?1)", encodeHeader(working)));
  need(connection_.execute("DELETE FROM working"));
  auto insert = need(connection_.prepare("INSERT INTO working VALUES(?1, ?2, ?3)"));
  std::int64_t position = 0;
  for (const auto& belief : working.objects) {
    if (change.shut_out.contains(belief.id)) continue;
    insert.bindAll(position++, belief.id);  // the belief is NULL if the track's row has it
    if (!change.rows.contains(belief.id)) insert.bind(3, encodeBelief(belief));
    need(insert.run());
  }
}

Result<Written> MapDatabase::write(const Batch& batch) {
  check(batch.working != nullptr, "a batch has a working set");
  return attempt([&] {
    auto transaction = need(Transaction::begin(connection_));
    // The sweep must come before new parts reuse the ids.
    if (batch.graph != nullptr && !graph_is_whole_) sweepGraph(connection_);
    Change change;
    Written written = putAll(batch, change);
    if (batch.graph != nullptr) written.unsound = writeGraph(connection_, *batch.graph);
    if (batch.acknowledged > 0) acknowledge(connection_, batch.acknowledged);
    need(transaction.commit());
    remember(*batch.working, change);
    graph_is_whole_ = graph_is_whole_ || batch.graph != nullptr;
    return written;
  });
}

Result<SavedGraph> MapDatabase::takeGraph() {
  auto graph = reader().graph();
  graph_is_whole_ = graph && graph->malformed == 0;
  return graph;
}

Written MapDatabase::putAll(const Batch& batch, Change& change) {
  change.revision = need(reader().revision()) + 1;
  for (const auto& belief : batch.working->objects) change.alive.insert(belief.id);
  regroup(batch, change);
  putObjects(batch, change);
  std::set<TrackId> away;
  for (const auto& [id, row] : committed_) away.insert(id);
  for (const auto& [id, placed] : batch.left) away.insert(id);
  addDoubtful(away);
  for (const ObjectId id : away) {
    if (change.alive.contains(id)) continue;
    if (isShared(id, batch)) {
      change.to_derive.insert(batch.identity->objectOf(id));
    } else {
      markLeft(id, change);
    }
  }
  for (const auto& [id, removal] : batch.removed) {
    if (removal.time < batch.working->stamp.time && change.alive.contains(id)) continue;
    end(id, removal, batch, change);
    change.shut_out.insert(id);
  }
  for (const ObjectId object : change.to_derive) derive(object, batch, change);
  if (batch.facts != nullptr) writeFacts(connection_, *batch.facts);
  putWorking(*batch.working, change);
  for (const auto& [key, value] :
       {std::pair("earth_anchor", &batch.earth_anchor), std::pair("cameras", &batch.cameras)}) {
    if (value->empty()) continue;
    need(connection_.run("REPLACE INTO meta VALUES(?1, ?2)", std::string_view(key), *value));
  }
  return nextRevision(change);
}

Written MapDatabase::nextRevision(const Change& change) {
  Written written{{change.objects.begin(), change.objects.end()}, change.revision};
  if (change.objects.empty()) {
    --written.revision;
    return written;
  }
  need(connection_.run("REPLACE INTO meta VALUES('revision', ?1)", written.revision));
  return written;
}

void MapDatabase::remember(const Objects& working, const Change& change) {
  committed_.clear();
  for (const auto& belief : working.objects) {
    const auto row = change.rows.find(belief.id);
    if (row != change.rows.end()) committed_.insert(*row);
  }
}

}  // namespace perdure::map_store
