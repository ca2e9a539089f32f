// What the network says of an object that it was asked about and that no box met (eq. 7: the
// likelihood at the predicted projection; services/inference/README.md, "Top-down").
//
// Of an object that is in sight and not reported the best activation at its place has another
// distribution than at a place where nothing is; ρ is their ratio. Without a box
//   A = (1 - v) + v (1 - P_D) ρ
// in place of 1 - v P_D: where nothing is, log ρ is negative on average, so that a ghost dies
// sooner than by its misses alone, whatever the selection of the best does. An answer is evidence
// of existence only: its box was chosen for being near the prediction and tells little of the
// place; it begins no object, is no hit, and does not raise existence beyond what the last look
// that showed the object left.
#pragma once

#include <vector>

#include "services/semantic_filter/core/association/score.h"

namespace perdure::semantic_filter {

/// `log_ratio` by the model's class; that of the object's best class counts. An answer of a class
/// that the model does not know says nothing.
void hearPrimed(ObjectLook& look, const Object& object, const std::vector<double>& log_ratio,
                const FrameContext& frame);

}  // namespace perdure::semantic_filter
