// Iterated EKF of one hypothesis, with the pose error as a consider state (paper, eq. 9;
// Bar-Shalom, Li 2001, ch. 10; Schmidt 1966). Derivation: tools/docs/maths/ekf.md.
#pragma once

#include <vector>

#include "services/semantic_filter/core/measurement/cuboid_projection.h"
#include "services/semantic_filter/core/measurement/frame.h"

namespace perdure::semantic_filter {

/// Returns the posterior given that box `z` is the object's. `repetition`: factor >= 1 on the
/// variance of the sides, for noise that repeats that of the last detection; an outlier is widened
/// further. `hidden`: sides that are not compared because a nearer object hides them. `at_prior`:
/// projection of the prior, if it is known.
Hypothesis updateWithBox(const Hypothesis& prior, const BoxMeasurement& z,
                         const std::array<bool, 4>& hidden, double repetition,
                         const FrameContext& frame, const ProjectedBox* at_prior = nullptr);

/// Mixes the prior `none` ("none of the boxes") and the posteriors `parts`, weighted by their
/// shares, to one Gaussian with the same mean and covariance (probabilistic data association). The
/// result is in `none`.
void mix(Hypothesis& none, double share_none, std::vector<Hypothesis>& parts);
inline constexpr double kNegligible = 0.01;  ///< posterior share below which a box is left out

}  // namespace perdure::semantic_filter
