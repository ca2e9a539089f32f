#include "common/mapping/graph/components.h"

#include <algorithm>

namespace perdure::mapping {
namespace {

AnchorId firstOf(std::map<AnchorId, AnchorId>& parents, AnchorId id) {
  while (parents.at(id) != id) id = parents[id] = parents.at(parents.at(id));
  return id;
}

}  // namespace

std::map<AnchorId, AnchorId> componentsOf(const PoseGraph& graph) {
  std::map<AnchorId, AnchorId> first;
  for (const auto& [id, pose] : graph.poses()) first.emplace_hint(first.end(), id, id);
  for (const auto& [id, edge] : graph.edges()) {
    if (graph.weight(id) < kBelieved) continue;
    const AnchorId a = firstOf(first, edge.a), b = firstOf(first, edge.b);
    first[std::max(a, b)] = std::min(a, b);
  }
  for (auto& [id, of] : first) of = firstOf(first, id);
  return first;
}

}  // namespace perdure::mapping
