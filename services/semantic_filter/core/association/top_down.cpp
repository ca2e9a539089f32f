#include "services/semantic_filter/core/association/top_down.h"

#include <algorithm>
#include <cmath>

#include "services/semantic_filter/core/association/tempering.h"

namespace perdure::semantic_filter {

void applyTopDown(TrackScore& score, const Track& track, const std::vector<double>& log_ratio,
                  const FrameContext& frame) {
  const auto k = frame.model->index.find(track.best().class_name);
  if (k == frame.model->index.end() || k->second >= log_ratio.size()) return;
  // Observations from one viewpoint share the mistakes of the network, so an answer in favour of
  // the track is tempered. An answer against it is limited by the unmapped occluder, as a miss is.
  double nats = log_ratio[k->second];
  if (nats > 0.0) {
    nats *= temperingExponent(score.hypotheses.front().correlated_observations,
                              frame.parameters->tempering.correlation);
  }
  for (HypothesisScore& h : score.hypotheses) {
    h.no_box =
        std::max(1.0 - h.detection_probability + h.undetected * (std::exp(nats) - 1.0), 1e-6);
  }
  score.top_down = true;
}

}  // namespace perdure::semantic_filter
