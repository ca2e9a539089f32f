// Update of PMF, existence and detectability by one observation, all from the same A (paper, eq. 4
// and 9). Derivation: tools/docs/maths/class_and_existence_update.md.
#pragma once

#include <vector>

#include "services/semantic_filter/core/update/attribution.h"

namespace perdure::semantic_filter {

/// `shares`: of each hypothesis, in order. `tempering`: exponent τ of the observation, 0 to 1.
/// `detected`: one of the boxes is more probably the track's than not. Leaves the weights
/// unnormalised. Returns the new existence, at most `existenceCeiling`; the track keeps the old
/// one.
double updateClassAndExistence(Track& track, const AllShares& shares, double tempering,
                               bool detected, const Parameters& parameters);

}  // namespace perdure::semantic_filter
