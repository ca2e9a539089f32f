// The origins of a map's objects: the objects of other maps whose evidence they contain, with the
// time of the last observation of each. Origins identify evidence that two maps share, even if ids
// have changed.
#pragma once

#include <map>
#include <optional>
#include <vector>

#include "common/mapping/fusion/map_contents.h"

namespace perdure::mapping {

/// Result of a search for an object by its id in another map.
struct Known {
  ObjectId id = 0;    ///< 0: not found; the object may have become history
  bool told = false;  ///< found in a recorded origin, not by equal id and first_seen
};

class Provenance {
 public:
  /// The map must have a session and outlive this object. Objects may be added to it later.
  explicit Provenance(const MapContents& map);

  /// Returns the origin that identifies an object of this map in other maps.
  Origin nameOf(ObjectId id) const;
  /// All origins of the object, including this map if it has observed the object since. If the
  /// object has not ended, includes the origins of objects merged into it.
  std::vector<Origin> of(ObjectId id) const;
  /// The recorded origins of the object itself, without those of merged objects.
  std::vector<Origin> toldOf(ObjectId id) const;
  /// Whether the object contains all evidence of `origin`.
  bool covers(ObjectId id, const Origin& origin) const;
  Known find(const Origin& origin) const;

  /// Records an origin. `origin.now` must be an object of the map. If the origin is recorded
  /// already, only the time of its last observation is updated.
  void add(const Origin& origin);
  /// Records this map as an origin of the object. Call it before the object's belief is changed.
  void tell(ObjectId id);
  const std::vector<Origin>& told() const { return told_; }

 private:
  bool isOwn(const Origin& origin) const;

  const MapContents& map_;
  SessionIdentity root_;
  std::vector<Origin> told_;
  std::multimap<ObjectId, std::size_t> by_id_, by_now_, by_survivor_;
};

}  // namespace perdure::mapping
