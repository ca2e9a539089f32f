#include "common/mapping/identity.h"

#include <utility>

#include "common/base/algorithms/disjoint_sets.h"

namespace perdure::mapping {

Identity::Identity(std::set<SameObject> facts) : facts_(std::move(facts)) { connect(); }

void Identity::add(const SameObject& fact) {
  if (fact.a != fact.b && facts_.insert(fact).second) connect();
}

void Identity::endLoop(EdgeId loop) {
  if (std::erase_if(facts_, [loop](const SameObject& fact) { return fact.loop == loop; }) > 0) {
    connect();
  }
}

void Identity::replaceLoop(EdgeId loop, EdgeId by) {
  for (const SameObject& fact : factsOf(loop)) {
    facts_.erase(fact);
    facts_.insert({by, fact.a, fact.b});
  }
}

ObjectId Identity::objectOf(TrackId track) const {
  const auto at = object_of_.find(track);
  return at == object_of_.end() ? track : at->second;
}

const std::vector<TrackId>& Identity::tracksOf(ObjectId object) const {
  static const std::vector<TrackId> kNone;
  const auto at = tracks_of_.find(object);
  return at == tracks_of_.end() ? kNone : at->second;
}

std::vector<SameObject> Identity::factsOf(EdgeId loop) const {
  std::vector<SameObject> result;
  for (auto at = facts_.lower_bound({loop, 0, 0}); at != facts_.end() && at->loop == loop; ++at) {
    result.push_back(*at);
  }
  return result;
}

void Identity::connect() {
  DisjointSets<TrackId> sets;
  for (const SameObject& fact : facts_) sets.join(fact.a, fact.b);
  object_of_ = sets.roots();
  tracks_of_.clear();
  for (const auto& [track, object] : object_of_) tracks_of_[object].push_back(track);
}

}  // namespace perdure::mapping
