#include "services/semantic_filter/probation.h"

#include <algorithm>

namespace perdure::semantic_filter {

bool missesAll(const std::vector<Prediction>& expected, const Detections& detections) {
  constexpr double kLikely = 0.5, kAtAll = 0.1;  // r·π·v; intersection over union
  bool any = false;
  for (const Prediction& prediction : expected) {
    if (prediction.probability < kLikely) continue;
    any = true;
    const auto lies_there = [&](const Detection& d) {
      return !d.primed && intersectionOverUnion(d.box, prediction.box) >= kAtAll;
    };
    const auto& list = detections.detections;
    if (std::any_of(list.begin(), list.end(), lies_there)) return false;
  }
  return any;
}

}  // namespace perdure::semantic_filter
