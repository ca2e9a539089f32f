// Adds sessions, anchors, edges and objects of another map to a map. Colliding ids are renumbered.
// Contents that both maps have are not added again.
#pragma once

#include <map>
#include <set>
#include <vector>

#include "common/mapping/fusion/map_contents.h"

namespace perdure::mapping {

/// An object that both maps contain, with the stored beliefs and records: `before` of the united
/// map, `now` of the other one.
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
  std::vector<WorldId> parted;    ///< sessions whose continuations differ; that of `other` is left
                                  ///< out
  std::set<ObjectId> objects;     ///< new objects
  std::vector<Renewed> renewed;   ///< known objects that were observed again, or that ended
  std::size_t corrections_left_out = 0;  ///< beyond kMostCorrections standing ones
};

/// Adds `other` to `map`. Beliefs of renewed objects do not change here, because their fusion
/// requires the united graph.
Addition unite(MapContents& map, const MapContents& other);

}  // namespace perdure::mapping
