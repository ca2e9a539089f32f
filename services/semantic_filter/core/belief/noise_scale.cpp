#include "services/semantic_filter/core/belief/noise_scale.h"

#include <algorithm>
#include <cmath>

namespace perdure::semantic_filter {
namespace {

constexpr double kLeastRatio = 0.04, kMostRatio = 9.0;

}  // namespace

double ErrorScales::ratio(std::uint64_t model, double assumed) const {
  if (assumed <= 0.0) return 1.0;
  for (const auto& [of, heard] : heard_) {
    if (of != model) continue;
    const double ratio = (assumed + heard.squares) / (assumed + heard.count);
    return std::clamp(ratio, kLeastRatio, kMostRatio);
  }
  return 1.0;
}

void ErrorScales::hear(std::uint64_t model, const Leftover& over) {
  if (!std::isfinite(over.ratio) || !(over.count > 0.0)) return;
  auto it = std::find_if(heard_.begin(), heard_.end(),
                         [model](const auto& entry) { return entry.first == model; });
  if (it == heard_.end()) it = heard_.insert(heard_.end(), {model, {}});
  Heard& heard = it->second;
  heard.squares += over.count * std::min(over.ratio, kMostRatio);
  heard.count += over.count;
  if (heard.count <= remembered_) return;
  heard.squares *= remembered_ / heard.count;
  heard.count = remembered_;
}

}  // namespace perdure::semantic_filter
