#include "common/mapping/loop_book.h"

namespace perdure::mapping {

std::vector<EdgeId> LoopBook::begin() {
  std::vector<EdgeId> waiting;
  for (const auto& [id, entry] : entries_) {
    if (!entry.told) waiting.push_back(id);
  }
  entries_.clear();  // judge() finds reported loop closures by their edges in the graph
  return waiting;
}

void LoopBook::add(LoopClosure loop, const LevelPose& before, double way_m) {
  const EdgeId id = loop.id;
  entries_[id] = {std::move(loop), before, way_m, false, std::nullopt};
}

void LoopBook::remove(EdgeId id) { entries_.erase(id); }

bool LoopBook::isTold(EdgeId id) const {
  const auto at = entries_.find(id);
  return at == entries_.end() || at->second.told;
}

const LoopClosure* LoopBook::closureOf(EdgeId id) const {
  const auto at = entries_.find(id);
  return at == entries_.end() || !at->second.loop ? nullptr : &*at->second.loop;
}

LoopBook::Verdict LoopBook::judge(const PoseGraph& graph, double way_m) {
  Verdict verdict;
  for (const auto& [id, edge] : graph.edges()) {
    if (edge.kind != EdgeKind::kLoop) continue;
    Entry& entry = entries_.try_emplace(id, Entry{{}, {}, way_m, true, {}}).first->second;
    if (graph.weight(id) >= kBelieved) {
      entry.doubted_m.reset();
      if (!std::exchange(entry.told, true)) {
        entry.loop->correction_m = (graph.pose(edge.b).p - entry.before.p).norm();
        verdict.told.push_back(*entry.loop);
      }
      continue;
    }
    if (!entry.doubted_m) entry.doubted_m = way_m;
    const double doubted_for_m = way_m - *entry.doubted_m;
    if (entry.told && doubted_for_m >= parameters_.withdraw_after_m)
      verdict.withdrawn.push_back(id);
    if (!entry.told && doubted_for_m >= parameters_.give_up_after_m) verdict.given_up.push_back(id);
  }
  return verdict;
}

}  // namespace perdure::mapping
