#include "tools/outputs/box_sizes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace perdure::tools {

std::optional<Doubt> doubtOfHeights(const std::vector<EstimatedHeight>& objects) {
  // Systematic part of the excess, because detectors draw boxes too wide or too narrow.
  constexpr double kSystematic = 0.15, kSurely = 2.0, kLeast = 10.0;
  double weight = 0.0, sum = 0.0, variance = 0.0;
  for (const auto& [excess, sigma, spread] : objects) {
    // The prior of the class pulls an estimate towards the mean by 1 - share.
    const double share = std::max(0.0, 1.0 - std::pow(sigma / spread, 2));
    weight += share, sum += excess, variance += share * spread * spread;
  }
  if (weight < kLeast) return std::nullopt;
  const double mean = sum / weight, deviation = std::sqrt(variance) / weight;
  if (std::abs(mean) < kSystematic + kSurely * deviation) return std::nullopt;
  return Doubt{mean > 0.0 ? "objects are too large" : "objects are too small",
               fmt::format("by boxes and poses, {} objects are {:.2f} (± {:.2f}) times as high as "
                           "their classes: the boxes were enlarged or reduced about their "
                           "centres, their classes are wrong, or the poses are not in metres",
                           objects.size(), std::exp(mean), std::exp(mean) * deviation)};
}

}  // namespace perdure::tools
