// The durable map: confirmed objects, the newest working set, and the answers to queries.
#pragma once

#include <compare>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/base/result.h"
#include "common/types/map.h"
#include "common/types/objects.h"
#include "services/map_store/core/belief_codec.h"
#include "services/map_store/core/graph/graph_tables.h"
#include "services/map_store/core/schema.h"
#include "services/map_store/core/sqlite.h"

namespace perdure::map_store {

/// A square of the map: [x, x + 1) × [y, y + 1) times tile_size_m.
struct Square {
  std::int32_t x = 0, y = 0;
  auto operator<=>(const Square&) const = default;
};

struct PlacedBelief {
  WorldId world;
  ObjectBelief belief;
};

/// The end of an object on the map: kGone, or kMerged into another object.
struct Removal {
  EventKind kind = EventKind::kGone;
  TimePoint time;
  ObjectId merged_into = 0;
};

struct StoredTrack;  // core/track_rows.h

/// The content of one commit, by track ids.
struct Batch {
  const Objects* working = nullptr;      ///< not null
  std::map<TrackId, PlacedBelief> left;  ///< confirmed tracks that left the working set
  std::map<TrackId, Removal> removed;
  /// Tracks that the graph placed and that were not detected since. Their stored rows do not
  /// change.
  std::set<TrackId> placed = {};
  const mapping::Unsaved* graph = nullptr;  ///< changed parts of the graph; null: no changes
  /// `identity` defines which tracks are one object, `facts` has its changes, and `regrouped` the
  /// affected tracks. If `identity` is null, each track is a separate object.
  const mapping::Identity* identity = nullptr;
  const mapping::Unsaved* facts = nullptr;
  std::set<TrackId> regrouped = {};
  std::int64_t acknowledged = 0;  ///< the server has the entries of the outbox up to this one
  std::string earth_anchor = {};  ///< position of M on Earth (earth_place.h); empty: not changed
  std::string cameras = {};  ///< what the cameras see (mapping/frames/sight.h); empty: not changed
};

struct Written {
  std::vector<ObjectId> objects;  ///< ids of objects that changed, were added or removed, each once
  std::uint64_t revision = 0;
  std::uint64_t unsound = 0;  ///< unsound parts of the graph (graph_codec.h), whose stored values
                              ///< remain
};

struct Found {
  std::vector<MapObject> objects;
  std::vector<ObjectBelief> beliefs;  ///< the objects in full, for kById and inFullNear
  std::vector<Correction> corrections;  ///< standing: of the object for kById, all for kAll
  bool truncated = false;
  std::uint64_t malformed = 0;  ///< rows that were left out because their belief could not be read
};

/// An object that is history, with its last stored belief.
struct EndedObject {
  PlacedBelief last;
  Removal end;
};

struct StoredPlace {
  ObjectId id = 0;
  WorldId world;  ///< the W of the position
  Eigen::Vector3d p_W = Eigen::Vector3d::Zero();
  TimePoint last_seen;
};

/// Returns the square that contains `p`; nothing if `p` is not finite or too far away.
std::optional<Square> squareOf(const Eigen::Vector3d& p, double tile_size_m);
MapObject mapObjectOf(const ObjectBelief& belief, const WorldId& world);

/// Answers queries about a map file. A spatial query searches one frame of reference.
class MapReader {
 public:
  /// Answers contain `corrections`, if it is not null. It must outlive the reader.
  explicit MapReader(const Connection* connection, const CorrectionsOf* corrections = nullptr)
      : connection_(connection), corrections_(corrections) {}

  /// Answers kById, kByClass, kByRadius (nearest first), kByBox and kAll (by id) with at most
  /// `limit` objects. kByRadius and kByBox search in query.world, or in `newest` if it is 0.
  Result<Found> find(const MapQuery& query, const WorldId& newest, std::uint32_t limit) const;
  /// All objects on the map, in full, by id; rows that cannot be read are left out.
  Result<std::vector<PlacedBelief>> beliefs() const;
  /// The objects of `world` within `radius` of `centre`, in full and as stored, nearest first; at
  /// most `limit`.
  Result<Found> inFullNear(const Eigen::Vector3d& centre, double radius, const WorldId& world,
                           std::uint32_t limit) const;
  /// The last belief of a track, as stored; nothing if it is not on the map.
  Result<std::optional<PlacedBelief>> beliefOf(TrackId track) const;
  /// Those of the objects `ids` that are on the map, in the order of `ids`; at most `limit`.
  Result<Found> byIds(const std::vector<ObjectId>& ids, std::size_t limit) const;
  /// The places of all objects on the map.
  Result<std::vector<StoredPlace>> places() const;
  /// The place of one object; nothing if it is not on the map.
  Result<std::optional<StoredPlace>> placeOf(ObjectId id) const;
  /// The objects that are history, by the time of their end; rows that cannot be read are left out.
  Result<std::vector<EndedObject>> ended() const;
  /// The objects that were merged into an object, by id.
  Result<std::vector<ObjectId>> mergedInto(ObjectId id) const;
  /// The working set of the last commit; nothing on an empty map.
  Result<std::optional<Objects>> working() const;
  /// The pose graph of the last commit; empty if the map has none.
  Result<SavedGraph> graph() const { return readGraph(*connection_); }
  Result<std::set<mapping::SameObject>> facts() const { return readFacts(*connection_); }
  Result<std::vector<Correction>> corrections() const { return readCorrections(*connection_); }
  /// The names of all classes that objects of the map ever had.
  Result<std::set<std::string>> classes() const;
  /// The `world` numbers of the map's objects.
  Result<std::set<std::uint64_t>> worlds() const;
  /// The position of M on Earth, as earthAnchorOfMap() writes it; empty if not known.
  Result<std::string> earthAnchor() const { return meta("earth_anchor"); }
  /// The fields of view of the last cameras, as mapping::toText() writes them; empty if not known.
  Result<std::string> cameras() const { return meta("cameras"); }
  Result<std::uint64_t> revision() const;
  Result<ObjectId> largestId() const;

 private:
  Result<std::string> meta(std::string_view key) const;
  Result<Found> collect(Statement& statement, std::size_t limit, const MapQuery& query = {}) const;
  Result<Statement> statementFor(const MapQuery& query, const WorldId& world) const;
  std::vector<Correction> correctionsFor(const MapQuery& query) const;

  const Connection* connection_;
  const CorrectionsOf* corrections_ = nullptr;
};

class MapDatabase {
 public:
  explicit MapDatabase(const StoreOptions& options);

  /// Commits everything or nothing. The data is durable on return. Does not write beliefs that did
  /// not change, or whose objects were removed at or after the time of `working`.
  Result<Written> write(const Batch& batch);

  /// Returns the graph to continue with. If parts of it were left out, the next write with a graph
  /// deletes their rows, because their ids are reused.
  Result<SavedGraph> takeGraph();

  MapReader reader() const { return MapReader(&connection_, &corrections_); }
  /// Sets the corrections for the answers of readers.
  void setCorrections(CorrectionsOf corrections) { corrections_ = std::move(corrections); }
  const std::string& notice() const { return notice_; }

 private:
  struct Row {
    std::uint64_t digest = 0;  ///< digest of the belief; 0: not known
    bool stored = false;
    std::optional<TimePoint> gone;
  };
  struct Change;  ///< changes of one write

  MapDatabase(OpenedStore opened, const StoreOptions& options);
  // These throw Failed; the public functions return its reason.
  void keepTileSize();
  void retile();
  void rememberWorking();
  Row rowOf(ObjectId id) const;
  Row rowOfTrack(TrackId id, const Batch& batch) const;
  void put(const PlacedBelief& placed, const Batch& batch, Change& change);
  void insert(const PlacedBelief& placed, const Square& square, const Bytes& bytes, Change& change);
  void putObjects(const Batch& batch, Change& change);
  void regroup(const Batch& batch, Change& change);
  void hide(const StoredTrack* track, TrackId id, ObjectId object, TimePoint time, Change& change);
  void derive(ObjectId object, const Batch& batch, Change& change);
  void addDoubtful(std::set<ObjectId>& ids) const;
  void markLeft(ObjectId id, Change& change);
  void remove(ObjectId id, const Removal& removal, Change& change);
  void end(TrackId id, const Removal& removal, const Batch& batch, Change& change);
  void putWorking(const Objects& working, const Change& change);
  Written putAll(const Batch& batch, Change& change);
  Written nextRevision(const Change& change);
  void remember(const Objects& working, const Change& change);

  Connection connection_;
  CorrectionsOf corrections_;
  std::string notice_;
  double tile_size_m_;
  /// Rows of the working set's confirmed tracks, as committed.
  std::map<TrackId, Row> committed_;
  bool graph_is_whole_ = false;  ///< whether readGraph() leaves out no part of the file's graph
};

}  // namespace perdure::map_store
