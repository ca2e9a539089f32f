// Where a frame's boxes contradict what was thought to be hidden.
#pragma once

#include <vector>

#include "services/semantic_filter/core/belief/belief.h"
#include "services/semantic_filter/core/visibility/occlusion.h"

namespace perdure::semantic_filter {

/// Of an track with v = 0 there may be a rest to see, which may be detected: its box is less
/// likely to be clutter, new, or of anything else. The track itself stays as it is.
void explainPartialViews(const Belief& belief, const std::vector<TrackVisibility>& visibilities,
                         FrameInput& input, const Parameters& parameters,
                         const ClassPriors& priors);

/// A box that a hidden track explains far better than any that is in visibility says that the
/// blocker was misjudged: that track can be seen.
void reviseOcclusion(Belief& belief, std::vector<TrackVisibility>& visibilities,
                     const FrameInput& input, const Parameters& parameters);

}  // namespace perdure::semantic_filter
