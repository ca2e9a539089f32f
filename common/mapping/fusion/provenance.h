// What objects of a map rest on: which objects of which maps, and up to when each was followed.
// Evidence that two maps have in common is known by it, whatever its ids have become.
#pragma once

#include <map>
#include <optional>
#include <vector>

#include "common/mapping/fusion/map_contents.h"

namespace perdure::mapping {

/// Where an object is what another map calls `name`.
struct Known {
  ObjectId id = 0;    ///< 0: nothing is. It may be history since
  bool told = false;  ///< by a row of provenance, not by the same id alone
};

class Provenance {
 public:
  /// The map must have a session, and outlive this. Objects may be added to it meanwhile.
  explicit Provenance(const MapContents& map);

  /// How other maps know the object: by the id that it has here.
  Origin nameOf(ObjectId id) const;
  /// All that the object rests on. Of one that has not ended this holds what was merged into it.
  std::vector<Origin> of(ObjectId id) const;
  /// Rows for the object itself, without what was merged into it.
  std::vector<Origin> toldOf(ObjectId id) const;
  bool covers(ObjectId id, const Origin& origin) const;
  Known find(const Origin& origin) const;

  /// `origin.now` is an object of the map. One that is known is only followed further.
  void add(const Origin& origin);
  /// Before its belief is changed, what it says of itself is told.
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
