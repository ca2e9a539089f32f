// Where every object on the map lies in M, kept in memory: the squares that the map is published in
// are cut by it, and questions about places are answered by it.
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

  /// An object on the map that is new or has changed. `record`: what the graph knows of it, or
  /// null.
  void put(const StoredPlace& stored, const mapping::ObjectRecord* record,
           const mapping::MapFrames& frames);
  /// It is no longer on the map.
  void erase(ObjectId id);
  /// The graph has changed: everything lies where `frames` says. The squares of what has moved by
  /// less than 0.1 m since they were taken are not stale.
  void lay(const mapping::MapFrames& frames);

  /// The anchor that an object belongs to; 0: none, or it is not on the map.
  mapping::AnchorId anchorOf(ObjectId id) const;
  /// Of kByRadius, nearest first, and kByBox, by id: what lies there in this M.
  std::vector<ObjectId> find(const MapQuery& query, const WorldId& map) const;
  /// Squares whose contents have changed since they were taken last, each with the ids in it, in
  /// order; none: it is empty.
  std::map<Square, std::vector<ObjectId>> takeStale();
  std::size_t size() const { return places_.size(); }

 private:
  struct Place {
    mapping::AnchorId anchor = 0;
    Eigen::Vector3d p_W = Eigen::Vector3d::Zero(), p_M = Eigen::Vector3d::Zero();
    WorldId map;  ///< M
    bool provisional = false;
    std::optional<Square> square;  ///< in which it was shown; nothing: beyond all squares
    double moved_m = 0.0;          ///< since then, at most
  };
  void show(Place& place);

  double tile_size_m_;
  std::map<ObjectId, Place> places_;
  std::set<Square> stale_;
};

/// A map as it lies in M: what is stored, turned by the anchors that it belongs to.
class MapInM {
 public:
  using Records = std::function<const mapping::ObjectRecord*(ObjectId)>;
  /// `records`: what the graph knew when it was stored.
  MapInM(MapReader reader, double tile_size_m, Records records)
      : reader_(reader), places_(tile_size_m), records_(std::move(records)) {}

  /// Before anything is asked. All of it or nothing.
  Result<void> load(mapping::MapFrames frames);
  bool isLoaded() const { return loaded_; }
  /// What a commit has changed, by ids, directly after it. What cannot be read is read by the next
  /// call.
  Result<void> refresh(const std::vector<ObjectId>& changed);
  /// The graph has grown. `moved`: what it has of before lies elsewhere.
  void follow(mapping::MapFrames frames, bool moved);

  /// Answers by id, class, radius, box and all as MapReader::find does, in M. Places are looked for
  /// in the M that `newest` lies in.
  Result<Found> find(const MapQuery& query, const WorldId& newest, std::uint32_t limit) const;
  /// The objects of a square.
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
