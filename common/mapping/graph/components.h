// Which anchors hang together by edges that are believed.
#pragma once

#include <map>

#include "common/mapping/graph/pose_graph.h"

namespace perdure::mapping {

/// Of each anchor the first one, that with the lowest id, of its component.
std::map<AnchorId, AnchorId> componentsOf(const PoseGraph& graph);

}  // namespace perdure::mapping
