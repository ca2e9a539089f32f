// Weigh: what a look makes of π, of r, and of how well the track can be detected from here, from
// the same A (eq. 7, DESIGN 5, items 3 and 5).
#pragma once

#include <vector>

#include "services/semantic_filter/core/update/attribution.h"

namespace perdure::semantic_filter {

/// `shares` are of each hypothesis, in order; `tempering` of the look beside earlier ones is within
/// 0 … 1; `detected`: it more probably shows the track than not. Hypotheses' weights are left
/// unnormalised. Returns existence as it is to become, at most `existenceCeiling`.
double updateClassAndExistence(Track& track, const std::vector<Shares>& shares, double tempering,
                               bool detected, const Parameters& parameters);

}  // namespace perdure::semantic_filter
