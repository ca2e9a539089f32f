// How large the errors of a network's boxes are beside what is assumed of them (box.* of
// parameters.h, or what the network says itself): learned from what the fits of all looks at things
// that stand leave over, for each network of its own. Part of the belief: a late frame finds it as
// it was.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

namespace perdure::semantic_filter {

/// What a fit leaves over of the boxes.
struct Leftover {
  double ratio = 1.0;  ///< squared residuals by their variance, per degree of freedom
  double sides = 0.0;  ///< new ones that it is of; a side that comes again tells nothing new
};

class BoxScales {
 public:
  /// Of the variances of noise and b, true by assumed. `assumed_sides`: seen sides that weigh as
  /// much as the assumption; 0: it is believed for good.
  double ratio(std::uint64_t model, double assumed_sides) const;
  /// `over` is beside what was assumed at first, not beside the ratio so far.
  void hear(std::uint64_t model, const Leftover& over);

 private:
  struct Heard {
    double squares = 0.0, sides = 0.0;
  };
  std::vector<std::pair<std::uint64_t, Heard>> heard_;  ///< few networks
};

}  // namespace perdure::semantic_filter
