// Read access to the graph, for display.
#include <algorithm>

#include "common/mapping/mapper.h"

namespace perdure::mapping {

/// Sets the evidence of a loop closure: its pairs and number of landmarks. If it was found before
/// the present session, the evidence is its facts.
void Mapper::putWitnesses(EdgeId loop, std::vector<std::pair<ObjectId, ObjectId>>& pairs,
                          std::size_t& points) const {
  if (const LoopClosure* closure = loop_book_.closureOf(loop)) {
    pairs = closure->match.pairs;
    points = closure->match.points;
    return;
  }
  for (const SameObject& fact : state_.identity().factsOf(loop)) pairs.emplace_back(fact.a, fact.b);
}

std::vector<Mapper::Loop> Mapper::loops() const {
  std::vector<Loop> result;
  for (const auto& [id, edge] : state_.graph().edges()) {
    if (edge.kind == EdgeKind::kOdometry) continue;
    Loop loop{id, edge, state_.graph().weight(id)};
    if (edge.kind == EdgeKind::kLoop) {
      loop.told = loop_book_.isTold(id);
      putWitnesses(id, loop.pairs, loop.points);
    }
    result.push_back(std::move(loop));
  }
  return result;
}

std::map<AnchorId, Eigen::Vector4d> Mapper::variances() {
  if (builder_.last()) return marginals().variances();
  if (state_.anchors().empty()) return {};
  return Marginals(state_.graph(), state_.anchors().rbegin()->first).variances();
}

std::size_t Mapper::objectsOf(AnchorId anchor) const {
  const std::set<ObjectId>& seen = state_.seenFrom(anchor);
  return static_cast<std::size_t>(std::count_if(seen.begin(), seen.end(), [&](ObjectId id) {
    const ObjectRecord& record = state_.records().at(id);
    return record.confirmed && record.sighting.anchor == anchor;
  }));
}

std::optional<AnchorId> Mapper::newestAnchor(const WorldId& session) const {
  if (const auto newest = state_.newestOf(session)) return newest->id;
  if (state_.anchors().empty()) return std::nullopt;
  return state_.anchors().rbegin()->first;
}

}  // namespace perdure::mapping
