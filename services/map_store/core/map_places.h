// The positions in M of all objects, which determine squares and answer spatial queries.
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
  /// Places all objects again, as `frames` defines after a change of the graph. A square becomes
  /// stale if an object moved 0.1 m or more since the square was taken.
  void lay(const mapping::MapFrames& frames);

  /// The anchor of an object; 0: it has none, or is not on the map.
  mapping::AnchorId anchorOf(ObjectId id) const;
  /// The objects in this M for kByRadius (nearest first) and kByBox (by id).
  std::vector<ObjectId> find(const MapQuery& query, const WorldId& map) const;
  /// Squares that changed since they were last taken, with their ids in order; empty: no ids.
  std::map<Square, std::vector<ObjectId>> takeStale();
  std::size_t size() const { return places_.size(); }

 private:
  struct Place {
    mapping::AnchorId anchor = 0;
    Eigen::Vector3d p_W = Eigen::Vector3d::Zero(), p_M = Eigen::Vector3d::Zero();
    WorldId map;  ///< the M of the position
    bool provisional = false;
    std::optional<Square> square;  ///< square in which it was published; nothing: beyond all
    double moved_m = 0.0;          ///< upper bound of its motion since then
  };
  void show(Place& place);

  double tile_size_m_;
  std::map<ObjectId, Place> places_;
  std::set<Square> stale_;
};

/// A map in M: the stored objects, transformed by their anchors.
class MapInM {
 public:
  using Records = std::function<const mapping::ObjectRecord*(ObjectId)>;
  /// `records`: the graph's records at the time of storage.
  MapInM(MapReader reader, double tile_size_m, Records records)
      : reader_(reader), places_(tile_size_m), records_(std::move(records)) {}

  /// Must precede all queries. Loads everything or nothing.
  Result<void> load(mapping::MapFrames frames);
  bool isLoaded() const { return loaded_; }
  /// Takes the changes of a commit. Rows that cannot be read now are read by the next call.
  Result<void> refresh(const std::vector<ObjectId>& changed);
  /// The graph has grown. `moved`: earlier parts of it have moved too.
  void follow(mapping::MapFrames frames, bool moved);

  /// Answers queries by id, class, radius and box, and for all objects, as MapReader::find does, in
  /// M. Spatial queries search in the M of `newest`.
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
