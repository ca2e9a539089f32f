// Conversion between a track and its published belief. Derivation:
// tools/docs/maths/state_and_mixture.md.
#pragma once

#include "services/semantic_filter/core/belief/classes/class_prior.h"
#include "services/semantic_filter/core/belief/track.h"

namespace perdure::semantic_filter {

/// Returns for each class the mean of its heaviest hypothesis, and the second moments about it of
/// all with the same motion. An upper part is published as the whole object. `min_speed`: m/s.
ObjectBelief toBelief(const Track& track, const ClassPriors& priors, double min_speed);
/// Writes the same to `belief`, whose memory is reused.
void toBelief(const Track& track, const ClassPriors& priors, double min_speed,
              ObjectBelief& belief);

/// Returns a track with one hypothesis for each class. `back`: kRestore or kRecall.
Track fromBelief(const ObjectBelief& belief, const Matrix6d& pose_product, ExistenceEvidence back);

}  // namespace perdure::semantic_filter
