// A network's azimuth: it turns a hypothesis and weighs its yaw modes, and tells nothing else.
#pragma once

#include <vector>

#include "services/semantic_filter/core/update/attribution.h"

namespace perdure::semantic_filter {

/// A network's azimuth as a weak measurement of yaw modulo 180°, with `weight` in (0, 1]; head or
/// tail is kept as log-odds. Returns the likelihood of the azimuth, for weighing yaw modes only.
double updateWithAzimuth(Hypothesis& h, double azimuth, double sigma, double weight,
                         const FrameContext& frame);

/// By the azimuths of the boxes that may be the track's. The errors of azimuths are less
/// lookalike_nats from look to look than those of boxes: their exponent is the square root of the
/// look's tempering.
void updateAzimuths(Track& track, const std::vector<Shares>& shares, double tempering,
                    const std::vector<std::size_t>& looked_at,
                    const std::vector<BoxDetection>& boxes, const FrameContext& frame);

}  // namespace perdure::semantic_filter
