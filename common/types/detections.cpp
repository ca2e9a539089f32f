#include "common/types/detections.h"

#include <algorithm>

#include "common/base/check.h"

namespace perdure {

double intersectionOverUnion(const Box& a, const Box& b) {
  const double w = std::min(a.x2, b.x2) - std::max(a.x1, b.x1);
  const double h = std::min(a.y2, b.y2) - std::max(a.y1, b.y1);
  if (w <= 0 || h <= 0) return 0.0;
  return w * h / (a.area() + b.area() - w * h);
}

const char* nameOf(SwapStep step) {
  static constexpr std::array kNames{"rehearsing", "took_over", "passed", "rolled_back", "retired"};
  static_assert(kNames.size() == static_cast<std::size_t>(SwapStep::kRetired) + 1);
  return nameAt(kNames, step);
}

}  // namespace perdure
