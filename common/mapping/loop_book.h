// Stores the state of each loop closure: tentative until the graph accepts it, then reported, and
// retracted if the graph later rejects it for some distance.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "common/mapping/graph/pose_graph.h"
#include "common/mapping/places/constellation.h"

namespace perdure::mapping {

/// One loop closure.
struct LoopClosure {
  EdgeId id = 0;
  AnchorId a = 0, b = 0;  ///< b: the anchor of the body
  PlaceMatch match;
  bool joins = false;         ///< links a separate component to the map
  double correction_m = 0.0;  ///< change of the position of b in M when it was accepted
};

class LoopBook {
 public:
  explicit LoopBook(const LoopParameters& parameters) : parameters_(parameters) {}

  /// Begins or continues a session. Clears the book and returns the ids of tentative loop closures.
  std::vector<EdgeId> begin();
  /// Adds a tentative loop closure, found at the distance travelled `way_m`. `before` is the pose
  /// of its b in M before the optimisation.
  void add(LoopClosure loop, const LevelPose& before, double way_m);
  void remove(EdgeId id);
  /// Whether the loop closure was reported. True for all that were found before begin().
  bool isTold(EdgeId id) const;
  /// Returns null if the loop closure was found before begin(). The pointer is valid until the book
  /// changes.
  const LoopClosure* closureOf(EdgeId id) const;

  struct Verdict {
    std::vector<LoopClosure> told;  ///< accepted for the first time
    std::vector<EdgeId> withdrawn;  ///< reported, but rejected over withdraw_after_m
    std::vector<EdgeId> given_up;   ///< rejected over give_up_after_m, and never reported
  };
  /// Returns the changes of state. Call it after an optimisation. `way_m` is the distance
  /// travelled.
  Verdict judge(const PoseGraph& graph, double way_m);

 private:
  struct Entry {
    std::optional<LoopClosure> loop;  ///< nothing: found before begin()
    LevelPose before;
    double closed_m = 0.0;
    bool told = false;
    std::optional<double> doubted_m;  ///< distance travelled at which the graph began to reject it
  };

  LoopParameters parameters_;
  std::map<EdgeId, Entry> entries_;
};

}  // namespace perdure::mapping
