// The durable map: what was confirmed, the newest working set, and answers to questions about them.
#pragma once

#include <compare>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/types/map.h"
#include "common/types/objects.h"
#include "services/map_store/core/belief_codec.h"
#include "services/map_store/core/graph/graph_tables.h"
#include "services/map_store/core/schema.h"
#include "services/map_store/core/sqlite.h"

namespace perdure::map_store {

/// A square of the map, tile_size_m wide: [x, x + 1) × [y, y + 1) times the size.
struct Square {
  std::int32_t x = 0, y = 0;
  auto operator<=>(const Square&) const = default;
};

struct PlacedBelief {
  WorldId world;
  ObjectBelief belief;
};

/// Why an object is no longer on the map: kGone, or kMerged into another.
struct Removal {
  EventKind kind = EventKind::kGone;
  TimePoint time;
  ObjectId merged_into = 0;
};

struct StoredTrack;  // core/track_rows.h

/// What one commit writes. Ids are those of tracks. `left`: last beliefs of confirmed tracks that
/// left the working set.
struct Batch {
  const Objects* working = nullptr;  ///< not null
  std::map<TrackId, PlacedBelief> left;
  std::map<TrackId, Removal> removed;
  /// Of the working set: placed by the graph and not seen since. What is stored of them stays.
  std::set<TrackId> placed = {};
  const mapping::Unsaved* graph = nullptr;  ///< what of it has changed; null: nothing
  /// Which tracks are one object, what has changed of that, and the tracks that this concerns.
  /// Null: each track is an object of its own.
  const mapping::Identity* identity = nullptr;
  const mapping::Unsaved* facts = nullptr;
  std::set<TrackId> regrouped = {};
  std::int64_t acknowledged = 0;  ///< entries of the outbox that a server has
  std::string earth_anchor = {};  ///< of M (earth_place.h); empty: as it is stored
};

struct Written {
  std::vector<ObjectId> objects;  ///< that changed, came or went, each once
  std::uint64_t revision = 0;
  std::uint64_t unsound = 0;  ///< parts of the graph that are not finite; left as they are stored
};

struct Found {
  std::vector<MapObject> objects;
  std::vector<ObjectBelief> beliefs;  ///< of kById and inFullNear: the objects in full
  bool truncated = false;
  std::uint64_t malformed = 0;  ///< rows whose belief could not be read; left out
};

/// Where an object on the map was stored.
struct StoredPlace {
  ObjectId id = 0;
  WorldId world;  ///< W
  Eigen::Vector3d p_W = Eigen::Vector3d::Zero();
  TimePoint last_seen;
};

/// Where the centre of a belief lies on the map; nothing where it is not finite or too far away.
std::optional<Square> squareOf(const Eigen::Vector3d& p, double tile_size_m);
MapObject mapObjectOf(const ObjectBelief& belief, const WorldId& world);

/// Questions about a map file. Spatial ones concern one frame of reference.
class MapReader {
 public:
  explicit MapReader(const Connection* connection) : connection_(connection) {}

  /// Of kById, kByClass, kByRadius (nearest first), kByBox and kAll (by id); at most `limit`.
  /// kByRadius and kByBox look in query.world, or where that is 0 in `newest`.
  Result<Found> find(const MapQuery& query, const WorldId& newest, std::uint32_t limit) const;
  /// All objects on the map, in full, by id; rows that cannot be read are left out.
  Result<std::vector<PlacedBelief>> beliefs() const;
  /// What is nearer than radius, nearest first, in full.
  Result<Found> inFullNear(const Eigen::Vector3d& centre, double radius, const WorldId& world,
                           std::uint32_t limit) const;
  /// The last belief of a track; nothing if it is not on the map.
  Result<std::optional<PlacedBelief>> beliefOf(TrackId track) const;
  /// Of the objects with these ids, in their order, those that are on the map; at most `limit`.
  Result<Found> byIds(const std::vector<ObjectId>& ids, std::size_t limit) const;
  /// Of all objects on the map, by id.
  Result<std::vector<StoredPlace>> places() const;
  /// Nothing: the object is not on the map.
  Result<std::optional<StoredPlace>> placeOf(ObjectId id) const;
  /// What was merged into an object, by id.
  Result<std::vector<ObjectId>> mergedInto(ObjectId id) const;
  /// The working set as it was at the last commit; nothing on an empty map.
  Result<std::optional<Objects>> working() const;
  /// The pose graph as it was at the last commit; an empty one on a map without.
  Result<SavedGraph> graph() const { return readGraph(*connection_); }
  Result<std::set<mapping::SameObject>> facts() const { return readFacts(*connection_); }
  /// Frames of reference that the map has something of.
  Result<std::set<std::uint64_t>> worlds() const;
  /// Where on Earth M lies, as earthAnchorOfMap() writes it; empty: not known.
  Result<std::string> earthAnchor() const;
  Result<std::uint64_t> revision() const;
  Result<ObjectId> largestId() const;

 private:
  const Connection* connection_;
};

class MapDatabase {
 public:
  /// Throws StartupError.
  explicit MapDatabase(const StoreOptions& options);

  /// All of it or nothing, durable when it returns. Beliefs that did not change are not written;
  /// nor are those of objects removed at `working`'s time or later.
  Result<Written> write(const Batch& batch);

  /// The graph to go on with. What had to be left out of it is deleted at the next write of a
  /// graph, because its ids are given again.
  Result<SavedGraph> takeGraph();

  MapReader reader() const { return MapReader(&connection_); }
  const std::string& notice() const { return notice_; }

 private:
  /// What the file holds of one track, or of an object.
  struct Row {
    std::uint64_t digest = 0;  ///< of the belief; 0: not known
    bool stored = false;
    std::optional<TimePoint> gone;
  };
  struct Change;  ///< what one write has done so far

  MapDatabase(OpenedStore opened, const StoreOptions& options);
  Result<void> keepTileSize();
  Result<void> retile();
  Result<void> rememberWorking();
  Result<Row> rowOf(ObjectId id) const;
  Result<Row> rowOfTrack(TrackId id, const Batch& batch) const;
  Result<void> put(const PlacedBelief& placed, const Batch& batch, Change& change);
  Result<void> insert(const PlacedBelief& placed, const Square& square, const Bytes& bytes,
                      Change& change);
  Result<void> putObjects(const Batch& batch, Change& change);
  Result<void> regroup(const Batch& batch, Change& change);
  Result<void> hide(const StoredTrack* track, TrackId id, ObjectId object, TimePoint time,
                    Change& change);
  Result<void> derive(ObjectId object, const Batch& batch, Change& change);
  Result<void> addDoubtful(std::set<ObjectId>& ids) const;
  Result<void> markLeft(ObjectId id, Change& change);
  Result<void> remove(ObjectId id, const Removal& removal, Change& change);
  Result<void> end(TrackId id, const Removal& removal, const Batch& batch, Change& change);
  Result<void> putWorking(const Objects& working, const Change& change);
  Result<Written> putAll(const Batch& batch, Change& change);
  Result<Written> nextRevision(const Change& change);
  void remember(const Objects& working, const Change& change);

  Connection connection_;
  std::string notice_;
  double tile_size_m_;
  /// Of the confirmed tracks of the working set, as committed.
  std::map<TrackId, Row> committed_;
  bool graph_is_whole_ = false;  ///< nothing in the file that readGraph leaves out
};

}  // namespace perdure::map_store
