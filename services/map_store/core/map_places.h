// The positions in M of all objects. They determine the objects' squares, and answer spatial
// queries.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "common/mapping/map_frames.h"
#include "common/types/map.h"
#include "services/map_store/core/map_database.h"

namespace perdure::map_store {

class MapPlaces {
 public:
  explicit MapPlaces(double tile_size_m) : tile_size_m_(tile_size_m) {}

  /// Adds or updates an object on the map. `record`: its record in the graph, or null.
  void put(const StoredPlace& stored, const mapping::ObjectRecord* record,
           const mapping::MapFrames& frames);
  void erase(ObjectId id);
  /// Places all objects again with `frames`, after a change of the graph. The squares of an object
  /// become stale if it may have moved by more than 0.1 m since it was published, or if its M or
  /// `provisional` changed.
  void lay(const mapping::MapFrames& frames);

  /// The anchor of an object; 0 if it has none or is not on the map.
  mapping::AnchorId anchorOf(ObjectId id) const;
  /// The objects in this M for kByRadius (nearest first) and kByBox (by id).
  std::vector<ObjectId> find(const MapQuery& query, const WorldId& map) const;
  /// Returns the squares that changed since the last call, each with the ids of its objects in
  /// order.
  std::map<Square, std::vector<ObjectId>> takeStale();
  std::size_t size() const { return places_.size(); }

 private:
  struct Place {
    mapping::AnchorId anchor = 0;
    Eigen::Vector3d p_W = Eigen::Vector3d::Zero(), p_M = Eigen::Vector3d::Zero();
    WorldId map;  ///< the M of the position
    bool provisional = false;
    std::optional<Square> square;  ///< square in which it was published; nothing if it is too far
                                   ///< away
    double moved_m = 0.0;          ///< upper bound of its displacement since it was published
  };
  void show(Place& place);

  double tile_size_m_;
  std::map<ObjectId, Place> places_;
  std::set<Square> stale_;
};

/// The map in M: anchors transform the stored objects.
class MapInM {
 public:
  using Records = std::function<const mapping::ObjectRecord*(ObjectId)>;
  /// `records` returns the graph's record of an object, as of the last commit, or null.
  MapInM(MapReader reader, double tile_size_m, Records records)
      : reader_(reader), places_(tile_size_m), records_(std::move(records)) {}

  /// Loads the places of all objects, or none. Must precede all queries.
  Result<void> load(mapping::MapFrames frames);
  bool isLoaded() const { return loaded_; }
  /// Reads the rows that a commit changed. The next call reads those that cannot be read now.
  Result<void> refresh(const std::vector<ObjectId>& changed);
  /// Updates the frames after the graph has grown. `moved`: earlier parts of the graph have moved
  /// too.
  void follow(mapping::MapFrames frames, bool moved);

  /// Answers the queries of MapReader::find() with objects in M. Spatial queries search the M of
  /// the session `newest`.
  Result<Found> find(const MapQuery& query, const WorldId& newest, std::uint32_t limit) const;
  Result<Found> objects(const std::vector<ObjectId>& ids) const;
  std::map<Square, std::vector<ObjectId>> takeStale() { return places_.takeStale(); }

 private:
  Result<Found> inM(Result<Found> found) const;

  MapReader reader_;
  MapPlaces places_;
  Records records_;
  mapping::MapFrames frames_;
  std::set<ObjectId> unread_;
  bool loaded_ = false;
};

}  // namespace perdure::map_store
