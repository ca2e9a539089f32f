// Sets of ids that are joined pair by pair (union-find).
#pragma once

#include <algorithm>
#include <map>

namespace perdure {

/// Each id begins as a set of its own. The root of a set is its lowest id.
template <class Id>
class DisjointSets {
 public:
  Id rootOf(Id id) {
    parents_.try_emplace(id, id);
    while (parents_.at(id) != id) id = parents_[id] = parents_.at(parents_.at(id));
    return id;
  }
  void join(Id a, Id b) {
    const auto [low, high] = std::minmax({rootOf(a), rootOf(b)});
    parents_[high] = low;
  }
  /// Returns the root of each id that was passed to rootOf() or join().
  const std::map<Id, Id>& roots() {
    for (auto& [id, root] : parents_) root = rootOf(id);
    return parents_;
  }

 private:
  std::map<Id, Id> parents_;
};

}  // namespace perdure
