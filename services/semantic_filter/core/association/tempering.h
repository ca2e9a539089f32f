// Tempering: how much one more observation counts if its errors are correlated with earlier ones.
// Observations from one viewpoint share the errors of the network. Derivation:
// tools/docs/maths/class_and_existence_update.md.
#pragma once

#include "services/semantic_filter/core/belief/track.h"
#include "services/semantic_filter/core/measurement/frame.h"

namespace perdure::semantic_filter {

/// Returns the number of earlier observations whose errors are shared by one of `position` from
/// this view.
double correlatedObservations(const Eigen::Vector3d& position, const Viewpoint& last,
                              const View& view, const TemperingParameters& parameters);
/// Returns the tempering exponent τ, the information of one more observation after n correlated
/// ones, in units of the first: I(n) = n / (ρ n + 1 - ρ), τ = I(n+1) - I(n).
double temperingExponent(double observations, double correlation);

}  // namespace perdure::semantic_filter
