// The states of loop closures. A loop closure that the graph does not accept at once is tentative
// until others agree with it. An accepted one that is contradicted later is retracted.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "common/mapping/graph/pose_graph.h"
#include "common/mapping/places/constellation.h"

namespace perdure::mapping {

/// A loop closure.
struct LoopClosure {
  EdgeId id = 0;
  AnchorId a = 0, b = 0;  ///< b: the anchor of the body
  PlaceMatch match;
  bool joins = false;         ///< connects a session without a place to the map
  double correction_m = 0.0;  ///< change of the body's position in M
};

class LoopBook {
 public:
  explicit LoopBook(const LoopParameters& parameters) : parameters_(parameters) {}

  /// Begins a session, or continues one. Drops tentative loop closures and returns their ids.
  std::vector<EdgeId> begin();
  /// Adds a tentative loop closure at `way_m` of the session. `before`: the earlier pose of its b
  /// in M.
  void add(LoopClosure loop, const LevelPose& before, double way_m);
  void remove(EdgeId id);
  /// Whether it was reported. True for all loop closures of earlier processes.
  bool isTold(EdgeId id) const;
  /// Returns null if it was found before the last start or session. Valid until the next call of
  /// another function.
  const LoopClosure* closureOf(EdgeId id) const;

  struct Verdict {
    std::vector<LoopClosure> told;  ///< accepted for the first time
    std::vector<EdgeId> withdrawn;  ///< reported, but contradicted for some distance
    std::vector<EdgeId> given_up;   ///< rejected, and never reported
  };
  /// Call it after an optimisation. `way_m`: distance travelled in the session.
  Verdict judge(const PoseGraph& graph, double way_m);

 private:
  struct Entry {
    std::optional<LoopClosure> loop;  ///< nothing: reported by an earlier process
    LevelPose before;
    double closed_m = 0.0;
    bool told = false;
    std::optional<double> doubted_m;  ///< distance travelled when the graph stopped accepting it
  };

  LoopParameters parameters_;
  std::map<EdgeId, Entry> entries_;
};

}  // namespace perdure::mapping
