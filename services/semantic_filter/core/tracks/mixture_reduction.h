// Mixture reduction: merges and prunes the hypotheses of one track.
#pragma once

#include "services/semantic_filter/core/belief/class_prior.h"
#include "services/semantic_filter/core/belief/track.h"
#include "services/semantic_filter/core/parameters.h"

namespace perdure::semantic_filter {

/// Merges and prunes an track's hypotheses: near ones of the same class and motion become one,
/// light ones go, so do those that no longer have the size of their class, a dominant class ends
/// the others, a moving one that stands still is static, and a static track that its boxes
/// contradict gets a moving twin and one that is misplaced along the ray. Nothing may be left.
void reduceMixture(Track& track, const ClassPriors& priors, const Parameters& parameters);

}  // namespace perdure::semantic_filter
