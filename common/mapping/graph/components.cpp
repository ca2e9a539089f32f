#include "common/mapping/graph/components.h"

#include "common/base/algorithms/disjoint_sets.h"

namespace perdure::mapping {

std::map<AnchorId, AnchorId> componentsOf(const PoseGraph& graph) {
  DisjointSets<AnchorId> sets;
  for (const auto& [id, pose] : graph.poses()) sets.rootOf(id);
  for (const auto& [id, edge] : graph.edges()) {
    if (graph.weight(id) >= kBelieved) sets.join(edge.a, edge.b);
  }
  return sets.roots();
}

}  // namespace perdure::mapping
