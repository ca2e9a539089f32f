// How large the errors of a network's boxes and azimuths are beside what is assumed of them (box.*
// of parameters.h and the classes' priors, or what the network says itself): learned from what the
// fits of all looks at things that stand leave over, for each network of its own. Part of the
// belief: a late frame finds it as it was.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

namespace perdure::semantic_filter {

/// What a fit leaves over of what was measured.
struct ResidualRatio {
  double ratio = 1.0;  ///< squared residuals by their variance, per degree of freedom
  double count = 0.0;  ///< of new ones that it is of; what comes again tells nothing new
};

/// Of the sides of boxes, or of azimuths.
class NoiseScales {
 public:
  /// Of as many as are `remembered`: a network on another road has other errors.
  explicit NoiseScales(double remembered) : remembered_(remembered) {}

  /// Of the variances, true by assumed. `assumed`: as many as updateClassAndExistence as much as
  /// the assumption; 0: it is believed for good.
  double ratio(std::uint64_t model, double assumed) const;
  /// `over` is beside what was assumed at first, not beside the ratio so far.
  void learn(std::uint64_t model, const ResidualRatio& over);

 private:
  struct Sums {
    double squares = 0.0, count = 0.0;
  };
  double remembered_;
  std::vector<std::pair<std::uint64_t, Sums>> sums_;  ///< few networks
};

}  // namespace perdure::semantic_filter
