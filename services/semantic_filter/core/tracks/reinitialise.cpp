#include "services/semantic_filter/core/tracks/reinitialise.h"

#include <algorithm>
#include <utility>

#include "services/semantic_filter/core/belief/mixture_ops.h"

namespace perdure::semantic_filter {

bool reinitialise(Track& track, const ClassNumbers& pmf, const BoxDetection& detection,
                  const std::optional<RangeHint>& range, const FrameContext& frame) {
  auto initiated = initiate(detection, range, track.as_of, frame);
  if (!initiated) return false;
  const auto shares = classShares(*initiated);
  std::vector<Hypothesis> known;
  double of_known = 0.0;
  for (const auto& c : pmf) {
    const auto now = std::find_if(shares.begin(), shares.end(),
                                  [&](const ClassNumber& s) { return s.name == c.name; });
    if (c.name == kOtherClass || now == shares.end()) continue;
    of_known += c.value;
    for (const auto& h : initiated->hypotheses) {
      if (h.class_name != c.name) continue;
      known.push_back(h);
      known.back().weight *= c.value / now->value;
    }
  }
  if (of_known > 0.5) {
    track.hypotheses = std::move(known);
  } else {
    track.hypotheses = std::move(initiated->hypotheses);
  }
  track.batch.restart();
  track.history.running_nis = 1.0;
  normalise(track, ClassEvidence::kGeometry);
  return true;
}

}  // namespace perdure::semantic_filter
