// Mixture reduction: merging and pruning of the hypotheses of one track (Bar-Shalom, Li 2001, eq.
// 1.4.16). Derivation: tools/docs/maths/state_and_mixture.md.
#pragma once

#include "services/semantic_filter/core/belief/track.h"
#include "services/semantic_filter/core/measurement/frame.h"

namespace perdure::semantic_filter {

/// - Merges near hypotheses of the same class and motion.
/// - Prunes light hypotheses, those of implausible size, and other classes if one class dominates.
/// - Stops moving hypotheses that are slow.
/// - Adds a moving copy, and one misplaced along the ray, to a static track that boxes contradict.
/// The result may have no hypothesis.
void reduceMixture(Track& track, const FrameContext& frame);

}  // namespace perdure::semantic_filter
