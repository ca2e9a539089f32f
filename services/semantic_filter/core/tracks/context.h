// Context: what a thing may be by what stands near it (chairs stand by tables). A prior that is
// laid over the PMF where it is published, and over nothing else: the recursion never sees it. It
// is made of what the neighbours are believed to be without theirs, so that it cannot feed on
// itself: two tracks that look lookalike_nats in inflation do not make each other certain.
//
//   π'_k ∝ π_k exp(c_k),   c_k = Σ_j log((1 - r_j) + r_j Σ_b π_jb exp(M_kb)),
//
// over neighbours j at rest within the matrix' radius, scaled so that no two c_k differ by more
// than kMostContext.
#pragma once

#include <vector>

#include "services/semantic_filter/core/belief/class_prior.h"
#include "services/semantic_filter/core/belief/track.h"

namespace perdure::semantic_filter {

inline constexpr double kMostContext = 1.0;   ///< nats between any two classes
inline constexpr double kFreshContext = 0.1;  ///< nats of change that are worth publishing

/// c of each of the track's classes, from `tracks`, of which it is one or not.
std::vector<ClassNumber> contextOf(const Track& track, const std::vector<Track>& tracks,
                                   const ContextMatrix& matrix);
/// Brings the context of what can be seen up to date where it is new or has changed by
/// kFreshContext; what is not seen keeps its own. Does nothing with an empty matrix.
void contextualise(std::vector<Track>& tracks, const ContextMatrix& matrix);

/// Lays the track's context over its published belief, ledger included.
void addContext(ObjectBelief& belief, const Track& track);
/// The belief as it was before addContext, by its ledger.
void removeContext(ObjectBelief& belief);

}  // namespace perdure::semantic_filter
