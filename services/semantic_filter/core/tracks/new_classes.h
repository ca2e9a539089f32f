// Classes that a new model brings enter the tracks that are there already (DESIGN 4, "Swapping
// inference"): at their prior, with the geometry that the track has, when the track is next seen.
#pragma once

#include "services/semantic_filter/core/association/score.h"

namespace perdure::semantic_filter {

/// Gives the track hypotheses of classes that this frame's model knows and that it was never
/// considered about: of those as many, and by the same rule, as a birth from the box that shows it
/// would consider. True where its hypotheses changed: then it must be looked at again.
bool admitNewClasses(Track& track, const TrackScore& score, const std::vector<BoxDetection>& boxes,
                     const FrameContext& frame);

}  // namespace perdure::semantic_filter
