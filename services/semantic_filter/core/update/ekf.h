// Iterated EKF of one hypothesis, with the pose error as a consider state (paper, eq. 9;
// Bar-Shalom, Li 2001, ch. 10; Schmidt 1966). Derivation: tools/docs/maths/ekf.md.
#pragma once

#include <vector>

#include "services/semantic_filter/core/measurement/cuboid_projection.h"
#include "services/semantic_filter/core/measurement/frame.h"

namespace perdure::semantic_filter {

/// The posterior given that box `z` is the object's. `repetition`: factor >= 1 on the variance of
/// repeated noise. `hidden`: sides not to compare. `at_prior`: projection of the prior, if known.
Hypothesis updateWithBox(const Hypothesis& prior, const BoxMeasurement& z,
                         const std::array<bool, 4>& hidden, double repetition,
                         const FrameContext& frame, const ProjectedBox* at_prior = nullptr);

/// Mixes the prior `none` ("none of the boxes") and the posteriors `parts`, weighted by their
/// shares, to one Gaussian with the same two moments (probabilistic data association), in `none`.
void mix(Hypothesis& none, double share_none, std::vector<Hypothesis>& parts);
inline constexpr double kNegligible = 0.01;  ///< posterior share below which a box is left out

}  // namespace perdure::semantic_filter
