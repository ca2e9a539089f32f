// The origins of a map's objects: the objects of other maps that they contain, and the time of the
// last observation of each. This identifies evidence that two maps share, even if ids have changed.
#pragma once

#include <map>
#include <optional>
#include <vector>

#include "common/mapping/fusion/map_contents.h"

namespace perdure::mapping {

/// Result of a search for an object by its id in another map.
struct Known {
  ObjectId id = 0;    ///< 0: not found; the object may be history since
  bool told = false;  ///< found in a recorded origin, not only by an equal id
};

class Provenance {
 public:
  /// The map must have a session and outlive this object. Objects may be added to the map in the
  /// meantime.
  explicit Provenance(const MapContents& map);

  /// The identity of the object in other maps, from its id in this map.
  Origin nameOf(ObjectId id) const;
  /// All origins of the object. For an object that has not ended they include those of merged
  /// objects.
  std::vector<Origin> of(ObjectId id) const;
  /// The recorded origins of the object itself, without those of merged objects.
  std::vector<Origin> toldOf(ObjectId id) const;
  bool covers(ObjectId id, const Origin& origin) const;
  Known find(const Origin& origin) const;

  /// `origin.now` must be an object of the map. For a known origin only the time of the last
  /// observation is updated.
  void add(const Origin& origin);
  /// Records the object's own origin. Call it before its belief is changed.
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
