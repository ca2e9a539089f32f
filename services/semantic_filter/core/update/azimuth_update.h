// Update by the network's azimuth: it changes yaw, heading and the weights of yaw modes, and
// nothing else. (The paper uses azimuths at initiation only: "Initialization", line 284.)
// Derivation: tools/docs/maths/azimuth_and_heading.md.
#pragma once

#include <vector>

#include "services/semantic_filter/core/update/attribution.h"

namespace perdure::semantic_filter {

/// Updates the yaw (modulo 180°) by an EKF and the heading by its log-odds. `azimuth`, `sigma`:
/// rad. `weight`: in (0, 1]. Returns the likelihood of the azimuth, 1/rad. It is for the weights of
/// yaw modes only.
double updateWithAzimuth(Hypothesis& h, double azimuth, double sigma, double weight,
                         const FrameContext& frame);

/// Updates all hypotheses by the azimuths of the boxes that may be the track's. Errors of azimuths
/// are less correlated between observations than those of boxes. So their exponent is √`tempering`.
void updateAzimuths(Track& track, const AllShares& shares, double tempering,
                    const ScratchVector<std::size_t>& gated, const std::vector<BoxDetection>& boxes,
                    const FrameContext& frame);

}  // namespace perdure::semantic_filter
