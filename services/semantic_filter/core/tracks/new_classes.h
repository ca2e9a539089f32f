// New classes: the classes of a new network enter the tracks that exist, at their prior and with
// the geometry of the track, when the track is next detected. (The paper, line 279, has a fixed set
// of classes.) Derivation: tools/docs/maths/new_classes.md.
#pragma once

#include "services/semantic_filter/core/association/score.h"

namespace perdure::semantic_filter {

/// Adds hypotheses of new classes of this frame's model that an initiation from the track's box
/// would keep. Returns whether hypotheses changed; the track must then be scored again.
bool admitNewClasses(Track& track, const TrackScore& score, const std::vector<BoxDetection>& boxes,
                     const FrameContext& frame);

}  // namespace perdure::semantic_filter
