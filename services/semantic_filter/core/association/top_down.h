// What the network says of an track that it was asked about and that no box met (eq. 7: the
// likelihood at the predicted projection; services/inference/README.md, "Top-down").
//
// Of an track that is in visibility and not reported the best activation at its place has another
// distribution than at a place where nothing is; ρ is their ratio. Without a box
//   A = (1 - v) + v (1 - P_D) ρ
// in place of 1 - v P_D: where nothing is, log ρ is negative on average, so that a ghost dies
// sooner than by its misses alone, whatever the selection of the best does. An answer is detection
// of existence only: its box was chosen for being near the prediction and tells little of the
// place; it begins no track, is no hit, and does not raise existence beyond what the last score
// that showed the track left.
#pragma once

#include <vector>

#include "services/semantic_filter/core/association/score.h"

namespace perdure::semantic_filter {

/// `log_ratio` by the model's class; that of the track's best class counts. An answer of a class
/// that the model does not know says nothing.
void applyTopDown(TrackScore& score, const Track& track, const std::vector<double>& log_ratio,
                  const FrameContext& frame);

}  // namespace perdure::semantic_filter
