// Where a frame's boxes contradict what was thought to be hidden.
#pragma once

#include <vector>

#include "services/semantic_filter/core/belief/belief.h"
#include "services/semantic_filter/core/visibility/occlusion.h"

namespace perdure::semantic_filter {

/// Of an object with v = 0 there may be a rest to see, which may be detected: its box is less
/// likely to be clutter, new, or of anything else. The object itself stays as it is.
void explainRemnants(const Belief& belief, const std::vector<Sight>& sights, FrameInput& input,
                     const Parameters& parameters, const ClassPriors& priors);

/// A box that a hidden object explains far better than any that is in sight says that the blocker
/// was misjudged: that object can be seen.
void reveal(Belief& belief, std::vector<Sight>& sights, const FrameInput& input,
            const Parameters& parameters);

}  // namespace perdure::semantic_filter
