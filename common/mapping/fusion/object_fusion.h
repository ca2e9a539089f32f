// Updates the beliefs and records of objects when maps are fused: known objects that were observed
// again, and objects that a loop identifies as one.
#pragma once

#include <vector>

#include "common/mapping/fusion/united_map.h"
#include "common/mapping/graph/pose_graph.h"
#include "common/mapping/identity.h"

namespace perdure::mapping {

/// Replaces beliefs and records of known objects by newer ones. If the known belief contains
/// evidence that the newer one lacks, the two are fused with the present poses of the graph.
/// Returns the objects that have moved or are gone.
std::vector<Change> renew(MapContents& map, const Addition& addition);

/// Fuses the beliefs of objects that `identity` lists as the same object. `before` has their
/// records before this identification. Absorbed objects become history. Returns their number.
std::size_t mergeObjects(MapContents& map, const std::map<ObjectId, ObjectRecord>& before,
                         const Identity& identity, const PoseGraph& graph);

}  // namespace perdure::mapping
