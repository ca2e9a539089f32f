// Adds sessions, anchors, edges and objects of another map to a map. Colliding ids are renumbered;
// known contents are not added again.
#pragma once

#include <map>
#include <set>
#include <vector>

#include "common/mapping/fusion/map_contents.h"

namespace perdure::mapping {

/// The beliefs and records of an object in two maps that both contain it, as stored.
struct Renewed {
  ObjectId id = 0;  ///< id in the united map
  StoredObject before, now;
  std::optional<ObjectRecord> record_before, record_now;  ///< records in ids of the united map
  bool shared = false;  ///< `before` contains evidence that `now` lacks
};

struct Addition {
  std::vector<WorldId> sessions;  ///< new sessions, by their worlds in the united map
  std::vector<WorldId> grown;     ///< known sessions that continue
  std::size_t known = 0;          ///< sessions with nothing new
  std::vector<WorldId> parted;    ///< continued differently in two copies; left out
  std::set<ObjectId> objects;     ///< new objects
  std::vector<Renewed> renewed;   ///< known objects that were observed again, or that ended
};

/// Renewed objects retain their belief in `map`, because its fusion requires the graph.
Addition unite(MapContents& map, const MapContents& other);

}  // namespace perdure::mapping
