// Objects that stand in one place: solid things cannot. The replay's search compares places alone
// and leaves some of them apart; so does a filter that saw one thing as two.
// Derivation: tools/docs/maths/fusion.md.
#pragma once

#include <vector>

#include "common/mapping/fusion/map_contents.h"
#include "common/mapping/graph/pose_graph.h"
#include "common/mapping/identity.h"

namespace perdure::mapping {

/// What is to be merged; the older id survives. `aligned`: the map's sightings after the alignment,
/// `graph`: its poses. Two objects are one where they are of one class, the centre of each lies in
/// the cuboid of the other, their relation is known better than how wide the narrower one is, and
/// neither has a second such partner.
std::vector<MergeOrder> overlapping(const MapContents& map, const SavedMap& aligned,
                                    const PoseGraph& graph);

}  // namespace perdure::mapping
