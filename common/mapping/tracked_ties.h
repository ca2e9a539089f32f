// What objects that are seen again under their old ids say about the drift since then. The filter
// laid them where the graph said, and detections have since moved them to where they are.
// Derivation: tools/docs/maths/pose_graph.md.
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
    LevelGaussian T_Mb;  ///< by detections alone
    AnchorId home = 0;   ///< that most of the objects belong to
    std::vector<ObjectId> objects;  ///< seen on both visits as the same track: no loop is needed
  };
  /// Nothing while they say no more than the graph. Each object is used once in a visit.
  std::optional<Tie> find(const Whereabouts& body) const;
  void use(const Tie& tie, double way_m);
  void begin() { used_at_m_.clear(); }

 private:
  bool isUsed(ObjectId id, double way_m) const;

  Parameters parameters_;
  std::map<ObjectId, double> used_at_m_;  ///< way of the session
};

}  // namespace perdure::mapping
