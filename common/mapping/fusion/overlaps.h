// Finds objects that occupy the same space and must therefore be one solid object. They remain
// after the replay, which compares positions only, or if a filter tracked one object twice.
// Derivation: tools/docs/maths/fusion.md.
#pragma once

#include <vector>

#include "common/mapping/fusion/map_contents.h"
#include "common/mapping/graph/pose_graph.h"
#include "common/mapping/identity.h"

namespace perdure::mapping {

/// Returns the merges to do; the older id survives. `aligned` has the map's sightings after the
/// alignment, `graph` the poses. Two objects are merged if they have the same class, the centre of
/// each lies in the cuboid of the other, their relative position is known better than the width of
/// the narrower one, and neither has a second such partner.
std::vector<MergeOrder> overlapping(const MapContents& map, const SavedMap& aligned,
                                    const PoseGraph& graph);

}  // namespace perdure::mapping
