// KeyframeBatch that share a viewpoint share the errors of the network: how much one more is worth.
#pragma once

#include "services/semantic_filter/core/belief/track.h"
#include "services/semantic_filter/core/measurement/frame.h"

namespace perdure::semantic_filter {

/// Earlier looks that a score at `position` from here shares its errors with.
double correlatedObservations(const Eigen::Vector3d& position, const Viewpoint& last,
                              const View& view, const TemperingParameters& parameters);
/// Information of one more score after n correlated ones, in units of the first:
/// I(n) = n / (ρ n + 1 - ρ), worth = I(n+1) - I(n).
double temperingExponent(double observations, double correlation);

}  // namespace perdure::semantic_filter
