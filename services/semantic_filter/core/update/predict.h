// Prediction of a track, when it is next visible, to the time and view of a frame (Bar-Shalom, Li
// 2001, ch. 6). Derivation: tools/docs/maths/state_and_mixture.md.
#pragma once

#include "services/semantic_filter/core/belief/track.h"
#include "services/semantic_filter/core/measurement/frame.h"

namespace perdure::semantic_filter {

void predict(Track& track, TimePoint now, const PoseError& pose_error,
             const MotionParameters& parameters, const ViewWalk& walk);

}  // namespace perdure::semantic_filter
