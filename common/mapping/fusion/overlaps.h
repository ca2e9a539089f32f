// Finds objects that occupy the same place, which solid objects cannot do. The replay's search
// compares positions only and leaves some of them separate. A filter that tracked one object twice
// does so too. Derivation: tools/docs/maths/fusion.md.
#pragma once

#include <vector>

#include "common/mapping/fusion/map_contents.h"
#include "common/mapping/graph/pose_graph.h"
#include "common/mapping/identity.h"

namespace perdure::mapping {

/// The merges to be done; the older id survives. `aligned` has the map's sightings after the
/// alignment, `graph` its poses.
/// Two objects are merged on four conditions. They have the same class. The centre of each lies in
/// the cuboid of the other. Their relative position is known better than the width of the narrower
/// one. Neither has a second such partner.
std::vector<MergeOrder> overlapping(const MapContents& map, const SavedMap& aligned,
                                    const PoseGraph& graph);

}  // namespace perdure::mapping
