// Top-down likelihood: what the network says at a predicted measurement where it reported no box
// (paper, eq. 7: likelihood at the predicted projection; services/inference/README.md, "Top-down").
// Derivation: tools/docs/maths/joint_association.md, "Top-down likelihood".
//
// The best activation at a visible object that was not reported has another distribution than where
// nothing is; ρ is the ratio of the two. Without a box
//   A = (1 - v) + v (1 - P_D) ρ
// in place of 1 - v P_D. Where nothing is, log ρ is negative on average, although the best
// activation is selected. So a false track is deleted sooner than by its misses alone.
//
// An answer is evidence of existence only. Its box was chosen near the prediction and says little
// of the place. It initiates no track, is no hit, and does not raise existence above what the last
// hit left.
#pragma once

#include <vector>

#include "services/semantic_filter/core/association/score.h"

namespace perdure::semantic_filter {

/// `log_ratio`: by class of the model; that of the track's best class counts. If the model does not
/// know that class, nothing changes.
void applyTopDown(TrackScore& score, const Track& track, const std::vector<double>& log_ratio,
                  const FrameContext& frame);

}  // namespace perdure::semantic_filter
