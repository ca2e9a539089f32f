// Measures drift with objects that are observed again under their old ids. The filter recalled them
// at poses from the graph; new detections have corrected these poses. Derivation:
// tools/docs/maths/pose_graph.md.
#pragma once

#include <map>
#include <optional>
#include <vector>

#include "common/mapping/loop_search.h"

namespace perdure::mapping {

class TrackedTies {
 public:
  explicit TrackedTies(const Parameters& parameters) : parameters_(parameters) {}

  struct Tie {
    LevelGaussian T_Mb;             ///< estimate from detections alone
    AnchorId home = 0;              ///< anchor of the earlier visit
    std::vector<ObjectId> objects;  ///< observed on both visits as the same track
  };
  /// Returns the present tie; nothing if there are too few such objects, or if they do not reduce
  /// the uncertainty enough. Leaves out objects of ties used on this visit.
  std::optional<Tie> find(const Whereabouts& body) const;
  /// Records that the objects of the tie were used.
  void use(const Tie& tie, double way_m);
  /// Call it at the start of a session.
  void begin() { used_at_m_.clear(); }

 private:
  bool isUsed(ObjectId id, double way_m) const;

  Parameters parameters_;
  std::map<ObjectId, double> used_at_m_;  ///< distance travelled in the session at the last use
};

}  // namespace perdure::mapping
