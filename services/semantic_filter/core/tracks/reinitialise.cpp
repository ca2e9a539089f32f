#include "services/semantic_filter/core/tracks/reinitialise.h"

#include <algorithm>
#include <utility>

#include "services/semantic_filter/core/belief/mixture_ops.h"

namespace perdure::semantic_filter {

bool bearAgain(Object& object, const std::vector<ClassNumber>& pmf, const Evidence& evidence,
               const std::optional<RangeHint>& range, const FrameContext& frame) {
  auto born = bear(evidence, range, object.as_of, frame);
  if (!born) return false;
  const auto shares = classShares(*born);
  std::vector<Hypothesis> known;
  double of_known = 0.0;
  for (const auto& c : pmf) {
    const auto now = std::find_if(shares.begin(), shares.end(),
                                  [&](const ClassNumber& s) { return s.name == c.name; });
    if (c.name == kOtherClass || now == shares.end()) continue;
    of_known += c.value;
    for (const auto& h : born->hypotheses) {
      if (h.class_name != c.name) continue;
      known.push_back(h);
      known.back().weight *= c.value / now->value;
    }
  }
  if (of_known > 0.5) {
    object.hypotheses = std::move(known);
  } else {
    object.hypotheses = std::move(born->hypotheses);
  }
  object.keyframes.clear();
  object.remembers_all = true;
  object.fresh_keyframes = object.remembered = object.seek_modes_at = 0;
  object.smoothing_patience = 1;
  object.running_nis = 1.0;
  normalise(object, ClassEvidence::kGeometry);
  return true;
}

}  // namespace perdure::semantic_filter
