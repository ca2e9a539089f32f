// Prediction of a track to the time and view of a frame: process noise, motion, detector bias, pose
// correlation, detectability and survival (Bar-Shalom, Li 2001, ch. 6). Derivation:
// tools/docs/maths/state_and_mixture.md.
//
// A track is predicted when it is next visible. Until then its belief stays as it is.
#pragma once

#include "services/semantic_filter/core/belief/track.h"
#include "services/semantic_filter/core/measurement/frame.h"

namespace perdure::semantic_filter {

void predict(Track& track, TimePoint now, const PoseError& pose_error,
             const MotionParameters& parameters, const ViewWalk& walk);

}  // namespace perdure::semantic_filter
