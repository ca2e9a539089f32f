// Where a map lies in another frame of reference: what is seen now, laid over what is remembered
// (DESIGN 5, item 13: T_MW). Both frames are level, so that yaw and position are sought. Pairs of
// things propose, the likelihood of all that is seen decides, and only what stands out from every
// other way to lay the one over the other is believed.
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

/// Remembered things, laid out to be compared with many views.
class MapAlignment {
 public:
  MapAlignment(std::vector<PlacedThing> remembered, const AlignmentParameters& parameters);

  /// Nothing where too little is seen, it fits nowhere, or in more than one way.
  std::optional<FrameAlignment> align(const std::vector<PlacedThing>& seen) const;

  /// The best way to lay `seen` over the map and the best other one, whether they are believed or
  /// not; for tests and figures.
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
  std::vector<ClassNumber> common_;                                         ///< mean PMF
  std::map<std::pair<std::string, std::string>, std::vector<Pair>> pairs_;  ///< by distance
};

}  // namespace perdure::semantic_filter
