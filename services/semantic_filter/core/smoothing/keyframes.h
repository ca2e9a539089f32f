// The batch at an track that are remembered, so that a static thing can be estimated again from
// all of them at once: a filter that linearised at a wrong first depth, or that took the visible
// part of a thing for the whole, stays wrong; the batch does not.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "common/camera/camera_model.h"
#include "common/math/gaussian.h"
#include "services/semantic_filter/core/belief/track.h"
#include "services/semantic_filter/core/measurement/frame.h"

namespace perdure::semantic_filter {

/// Takes the keyframe in if it shows the track from where no remembered one does. Where there are
/// `limit` already, the one that tells least beside its neighbours goes. Whether anything changed.
bool addKeyframe(Track& track, Keyframe keyframe, const ViewScales& scales,
                 const SmoothingParameters& parameters);

/// Whether the keyframe may have been at `h`.
bool explains(const Hypothesis& h, const Keyframe& keyframe, const BoxParameters& parameters);

/// Takes b's keyframes into a's batch: both are of one object.
void mergeBatches(Track& a, const Track& b, const ViewScales& scales,
                  const SmoothingParameters& parameters);

}  // namespace perdure::semantic_filter
