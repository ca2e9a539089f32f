// What becomes of the beliefs and rows of objects when maps are brought together: known ones that
// were seen again, and those that a loop shows to be one.
#pragma once

#include <vector>

#include "common/mapping/fusion/united_map.h"
#include "common/mapping/graph/pose_graph.h"
#include "common/mapping/identity.h"

namespace perdure::mapping {

/// Takes what is newer of known objects, by the poses of the graph as it is. Where the belief rests
/// on what other maps have seen the two are fused. Says what stands elsewhere now, or is gone.
std::vector<Change> renew(MapContents& map, const Addition& addition);

/// Fuses the beliefs of objects that `identity` lists as the same object. `before`: the records as
/// they were. Absorbed objects become history. Returns their number.
std::size_t mergeObjects(MapContents& map, const std::map<ObjectId, ObjectRecord>& before,
                         const Identity& identity, const PoseGraph& graph);

}  // namespace perdure::mapping
