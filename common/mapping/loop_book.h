// Which loops are told, and which are no longer believed. A loop that the graph does not believe
// when it is closed waits for others that agree; one that was told and is contradicted later is
// withdrawn.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "common/mapping/graph/pose_graph.h"
#include "common/mapping/places/constellation.h"

namespace perdure::mapping {

/// A loop that was closed.
struct LoopClosure {
  EdgeId id = 0;
  AnchorId a = 0, b = 0;  ///< b: where the body was
  PlaceMatch match;
  bool joins = false;         ///< a session that belonged to nothing, with the map
  double correction_m = 0.0;  ///< how far the body's place in M moved
};

class LoopBook {
 public:
  explicit LoopBook(const LoopParameters& parameters) : parameters_(parameters) {}

  /// Another session, or the same one again: loops that wait are given up. Their ids.
  std::vector<EdgeId> begin();
  /// Closed at `way_m` of the session, not told yet. `before`: the pose of its b in M until then.
  void add(LoopClosure loop, const LevelPose& before, double way_m);
  void remove(EdgeId id);
  /// Whether it was told; so is what an earlier process has left.
  bool isTold(EdgeId id) const;
  /// How it was found; null where that was before the last start or session. Valid until the next
  /// call of another function.
  const LoopClosure* closureOf(EdgeId id) const;

  struct Verdict {
    std::vector<LoopClosure> told;  ///< believed, for the first time
    std::vector<EdgeId> withdrawn;  ///< told before, and contradicted for some way
    std::vector<EdgeId> given_up;   ///< not believed, and never told
  };
  /// After an optimisation, `way_m` on the session's way.
  Verdict judge(const PoseGraph& graph, double way_m);

 private:
  struct Entry {
    std::optional<LoopClosure> loop;  ///< nothing: told in an earlier process
    LevelPose before;
    double closed_m = 0.0;
    bool told = false;
    std::optional<double> doubted_m;  ///< on the way, since when it is not believed
  };

  LoopParameters parameters_;
  std::map<EdgeId, Entry> entries_;
};

}  // namespace perdure::mapping
