// Share of the instances of a class that move, learned from the objects of this drive beside the
// prior, each once and when it can be judged. Derivation: tools/docs/maths/state_and_mixture.md.
#pragma once

#include <map>
#include <memory>
#include <string>

#include "services/semantic_filter/core/belief/classes/class_prior.h"
#include "services/semantic_filter/core/belief/track.h"

namespace perdure::semantic_filter {

class MoverShares {
 public:
  /// Counts a track if this was the detection at which tracks are judged.
  void learn(const Track& track, double min_speed);
  /// Returns the prior probability that an instance of the class moves; 0 stays 0.
  double of(const ClassPrior& prior) const;

 private:
  struct Counts {
    double moving = 0.0, all = 0.0;
  };
  std::shared_ptr<const std::map<std::string, Counts>> counts_;  ///< shared by copies of the belief
};

}  // namespace perdure::semantic_filter
