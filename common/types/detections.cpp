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
  switch (step) {
    case SwapStep::kRehearsing:
      return "rehearsing";
    case SwapStep::kTookOver:
      return "took_over";
    case SwapStep::kPassed:
      return "passed";
    case SwapStep::kRolledBack:
      return "rolled_back";
    case SwapStep::kRetired:
      return "retired";
  }
  failCheck("a step of a swap is one of those declared", std::source_location::current());
}

}  // namespace perdure
