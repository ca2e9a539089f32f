#include "services/semantic_filter/core/box_scale.h"

#include <algorithm>
#include <cmath>

namespace perdure::semantic_filter {
namespace {

constexpr double kRemembered = 4000.0;  // sides; a network on another road has other errors
constexpr double kLeast = 0.04, kMost = 9.0;

}  // namespace

double BoxScales::ratio(std::uint64_t model, double assumed_sides) const {
  if (assumed_sides <= 0.0) return 1.0;
  for (const auto& [of, heard] : heard_) {
    if (of != model) continue;
    const double ratio = (assumed_sides + heard.squares) / (assumed_sides + heard.sides);
    return std::clamp(ratio, kLeast, kMost);
  }
  return 1.0;
}

void BoxScales::hear(std::uint64_t model, const Leftover& over) {
  if (!std::isfinite(over.ratio) || !(over.sides > 0.0)) return;
  auto it = std::find_if(heard_.begin(), heard_.end(),
                         [model](const auto& entry) { return entry.first == model; });
  if (it == heard_.end()) it = heard_.insert(heard_.end(), {model, {}});
  Heard& heard = it->second;
  heard.squares += over.sides * std::min(over.ratio, kMost);
  heard.sides += over.sides;
  if (heard.sides <= kRemembered) return;
  heard.squares *= kRemembered / heard.sides;
  heard.sides = kRemembered;
}

}  // namespace perdure::semantic_filter
