// Conversion between a track and its published belief. Derivation:
// tools/docs/maths/state_and_mixture.md.
#pragma once

#include "services/semantic_filter/core/belief/classes/class_prior.h"
#include "services/semantic_filter/core/belief/track.h"

namespace perdure::semantic_filter {

/// Publishes for each class the mean of its heaviest hypothesis with the second moments of the
/// others about it, and of an upper part the whole object. `min_speed`: m/s.
ObjectBelief toBelief(const Track& track, const ClassPriors& priors, double min_speed);
/// The same into `belief`, whose memory it uses again.
void toBelief(const Track& track, const ClassPriors& priors, double min_speed,
              ObjectBelief& belief);

/// Makes a track with one hypothesis for each class. `back`: kRestore or kRecall.
Track fromBelief(const ObjectBelief& belief, const Matrix6d& pose_product, ExistenceEvidence back);

}  // namespace perdure::semantic_filter
