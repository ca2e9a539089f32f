#include "services/semantic_filter/core/association/top_down.h"

#include <algorithm>
#include <cmath>

#include "services/semantic_filter/core/association/tempering.h"

namespace perdure::semantic_filter {

void hearPrimed(ObjectLook& look, const Object& object, const std::vector<double>& log_ratio,
                const FrameContext& frame) {
  const auto k = frame.model->index.find(object.best().class_name);
  if (k == frame.model->index.end() || k->second >= log_ratio.size()) return;
  // Looks from one place share what the network mistakes: what speaks for the object counts by
  // their worth. What speaks against it is held off by `screened`, as misses are.
  double nats = log_ratio[k->second];
  if (nats > 0.0) {
    nats *= worthOfLook(look.hypotheses.front().late_looks, frame.parameters->looks.correlation);
  }
  for (HypothesisLook& h : look.hypotheses) {
    h.silent = std::max(1.0 - h.detection + h.missed * (std::exp(nats) - 1.0), 1e-6);
  }
  look.primed = true;
}

}  // namespace perdure::semantic_filter
