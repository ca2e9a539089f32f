// Occlusion revision: boxes that contradict the predicted occlusion, and boxes of partial views
// (paper, line 182, has occlusion as yes or no). Derivation: tools/docs/maths/visibility.md.
#pragma once

#include <vector>

#include "services/semantic_filter/core/belief/belief.h"
#include "services/semantic_filter/core/visibility/occlusion.h"

namespace perdure::semantic_filter {

/// Adds the partial views of tracks with v = 0 to the clutter of each box
/// (BoxDetection::log_partial_views). Such a box is less likely a new object or that of another
/// track. The track with v = 0 does not change.
void explainPartialViews(const Belief& belief, const ScratchVector<TrackVisibility>& visibilities,
                         FrameInput& input, const Parameters& parameters,
                         const ClassPriors& priors);

/// A box that an occluded track explains far better than any visible one shows that the occluder
/// was misjudged. The occluded track gets v = visibility.minimum in this frame.
void reviseOcclusion(Belief& belief, ScratchVector<TrackVisibility>& visibilities,
                     const FrameInput& input, const Parameters& parameters);

}  // namespace perdure::semantic_filter
