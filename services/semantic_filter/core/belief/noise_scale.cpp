#include "services/semantic_filter/core/belief/noise_scale.h"

#include <algorithm>
#include <cmath>

namespace perdure::semantic_filter {

constexpr double kLeastRatio = 0.04, kMostRatio = 9.0;

double NoiseScales::ratio(std::uint64_t model, double assumed) const {
  if (assumed <= 0.0) return 1.0;
  for (const auto& [of, heard] : sums_) {
    if (of != model) continue;
    const double ratio = (assumed + heard.squares) / (assumed + heard.count);
    return std::clamp(ratio, kLeastRatio, kMostRatio);
  }
  return 1.0;
}

void NoiseScales::learn(std::uint64_t model, const ResidualRatio& over) {
  if (!std::isfinite(over.ratio) || !(over.count > 0.0)) return;
  auto it = std::find_if(sums_.begin(), sums_.end(),
                         [model](const auto& entry) { return entry.first == model; });
  if (it == sums_.end()) it = sums_.insert(sums_.end(), {model, {}});
  Sums& heard = it->second;
  heard.squares += over.count * std::min(over.ratio, kMostRatio);
  heard.count += over.count;
  if (heard.count <= remembered_) return;
  heard.squares *= remembered_ / heard.count;
  heard.count = remembered_;
}

}  // namespace perdure::semantic_filter
