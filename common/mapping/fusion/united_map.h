// Another map's sessions, anchors, edges and objects beside those of a map, renumbered where they
// collide; what the map knows already is not added again.
#pragma once

#include <map>
#include <set>
#include <vector>

#include "common/mapping/fusion/map_contents.h"

namespace perdure::mapping {

/// What an object was to each of two maps that know it, both as stored.
struct Renewed {
  ObjectId id = 0;  ///< in the united map
  StoredObject before, now;
  std::optional<ObjectRecord> record_before, record_now;  ///< in ids of the united map
  bool shared = false;  ///< `before` rests on evidence that `now` lacks
};

struct Addition {
  std::vector<WorldId> sessions;  ///< new ones, by their worlds in the united map
  std::vector<WorldId> grown;     ///< known ones that go on
  std::size_t known = 0;          ///< sessions with nothing new
  std::vector<WorldId> parted;    ///< that two copies continued in different ways: left out
  std::set<ObjectId> objects;     ///< new ones
  std::vector<Renewed> renewed;   ///< known ones that were seen again, or ended
};

/// Objects that are renewed keep their belief as it is in `map`: what becomes of it needs the
/// graph.
Addition unite(MapContents& map, const MapContents& other);

}  // namespace perdure::mapping
