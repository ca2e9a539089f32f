// Observations that are stored for the batch estimate. Derivation: tools/docs/maths/map_fit.md.
#pragma once

#include "services/semantic_filter/core/belief/track.h"
#include "services/semantic_filter/core/measurement/frame.h"

namespace perdure::semantic_filter {

/// Adds the keyframe if its view is new, and returns whether it did. If there are more than
/// `parameters.keyframes`, the one most similar to another is removed, but never the newest.
bool addKeyframe(Track& track, Keyframe keyframe, const ViewScales& scales,
                 const SmoothingParameters& parameters);

bool explains(const Hypothesis& h, const Keyframe& keyframe, const FrameContext& frame);

/// Adds the keyframes of b to those of a. Both tracks are one object.
void mergeBatches(Track& a, const Track& b, const ViewScales& scales,
                  const SmoothingParameters& parameters);

}  // namespace perdure::semantic_filter
