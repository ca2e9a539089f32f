// Map alignment: where a stored map lies in another frame of reference (ours). Derivation:
// tools/docs/maths/map_alignment.md.
//
// Both frames are level, so yaw and position are sought. Pairs of objects propose alignments, and
// the likelihood of all that is seen decides. An alignment is accepted only if it is clearly better
// than every other one.
#pragma once

#include <Eigen/Core>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "services/semantic_filter/core/memory/frame_alignment.h"
#include "services/semantic_filter/core/parameters.h"

namespace perdure::semantic_filter {

/// The objects of a map, prepared for comparison with many views.
class MapAlignment {
 public:
  MapAlignment(std::vector<PlacedThing> remembered, const AlignmentParameters& parameters);

  /// Returns nothing if too little is seen, or if it fits nowhere or in more than one way.
  std::optional<FrameAlignment> align(const std::vector<PlacedThing>& seen) const;

  /// Returns the best alignment, whether accepted or not, with the score of the best other one. For
  /// tests and figures.
  std::optional<FrameAlignment> best(const std::vector<PlacedThing>& seen) const;

  std::size_t size() const { return things_.size(); }

 private:
  class Search;
  struct Pair {
    double distance;
    std::size_t a, b;
  };
  std::vector<PlacedThing> things_;
  AlignmentParameters parameters_;
  Eigen::Vector3d middle_ = Eigen::Vector3d::Zero();
  std::vector<ClassNumber> common_;                                         ///< mean PMF of the map
  std::map<std::pair<std::string, std::string>, std::vector<Pair>> pairs_;  ///< sorted by distance
};

}  // namespace perdure::semantic_filter
