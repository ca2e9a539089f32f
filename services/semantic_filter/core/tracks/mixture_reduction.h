// Mixture reduction: merging and pruning of the hypotheses of one track (Bar-Shalom, Li 2001, eq.
// 1.4.16). Derivation: tools/docs/maths/state_and_mixture.md.
#pragma once

#include "services/semantic_filter/core/belief/track.h"
#include "services/semantic_filter/core/measurement/frame.h"

namespace perdure::semantic_filter {

/// Merges near hypotheses; prunes light, implausible and dominated ones; stops slow movers; gives a
/// contradicted static track a moving and a misplaced copy. Possibly none is left.
void reduceMixture(Track& track, const FrameContext& frame);

}  // namespace perdure::semantic_filter
