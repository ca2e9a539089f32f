// Predict, lazily (DESIGN 5, items 1, 2 and 11): process noise, motion, survival and the transition
// of the pose error are applied when an track can next be seen; hidden beliefs stay untouched.
#pragma once

#include <optional>

#include "services/semantic_filter/core/belief/track.h"
#include "services/semantic_filter/core/measurement/frame.h"

namespace perdure::semantic_filter {

/// Brings the track up to `now`: noise on every hypothesis, P_xg, survival of its existence.
void predict(Track& track, TimePoint now, const PoseError& pose_error,
             const MotionParameters& parameters, const ViewWalk& walk);

}  // namespace perdure::semantic_filter
