// Noise scale: squared ratio of true to assumed errors of boxes and azimuths, learned for each
// network. Derivation: tools/docs/maths/noise_scale.md.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

namespace perdure::semantic_filter {

struct ResidualRatio {
  double ratio = 1.0;  ///< squared residuals over their variance, per degree of freedom
  double count = 0.0;  ///< number of new residuals; keyframes of an earlier fit do not count again
};

/// The noise scale of box sides, or of azimuths, for each network.
class NoiseScales {
 public:
  /// Remembers at most `remembered` residuals, because a network has other errors on another road.
  explicit NoiseScales(double remembered) : remembered_(remembered) {}

  /// Returns true over assumed variance. The assumption weighs as much as `assumed` residuals; with
  /// 0 it is never changed.
  double ratio(std::uint64_t model, double assumed) const;
  /// `over` is relative to the first assumption, not to the present ratio.
  void learn(std::uint64_t model, const ResidualRatio& over);

 private:
  struct Sums {
    double squares = 0.0, count = 0.0;
  };
  double remembered_;
  std::vector<std::pair<std::uint64_t, Sums>> sums_;  ///< a list, because networks are few
};

}  // namespace perdure::semantic_filter
