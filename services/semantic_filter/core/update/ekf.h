// The iterated consider-EKF: one hypothesis and the boxes that may be its own.
#pragma once

#include <optional>
#include <vector>

#include "services/semantic_filter/core/measurement/cuboid_projection.h"
#include "services/semantic_filter/core/measurement/frame.h"

namespace perdure::semantic_filter {

/// One hypothesis against one box: the iterated consider-EKF. The box's variance counts `repeated`
/// times, and more where the box is an outlier. `at_prior` is the projection of the prior where it
/// is known already.
Hypothesis updateWithBox(const Hypothesis& prior, const BoxMeasurement& z,
                         const std::array<bool, 4>& hidden, double repeated,
                         const FrameContext& frame, const ProjectedBox* at_prior = nullptr);

/// Moment match of "no box" and each box by their shares, which are the parts' weights (the second
/// half of PDA).
void mix(Hypothesis& none, double share_none, std::vector<Hypothesis>& parts);
inline constexpr double kNegligible = 0.01;  ///< share of a box in an update

}  // namespace perdure::semantic_filter
