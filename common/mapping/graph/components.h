// Groups of anchors that are connected by accepted edges.
#pragma once

#include <map>

#include "common/mapping/graph/pose_graph.h"

namespace perdure::mapping {

/// Maps each anchor to the anchor with the lowest id in its component.
std::map<AnchorId, AnchorId> componentsOf(const PoseGraph& graph);

}  // namespace perdure::mapping
