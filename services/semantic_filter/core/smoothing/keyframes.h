// The looks at an object that are remembered, so that a static thing can be estimated again from
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

/// Takes the look in if it shows the object from where no remembered one does. Where there are
/// `limit` already, the one that tells least beside its neighbours goes. Whether anything changed.
bool remember(Object& object, Keyframe keyframe, const ViewScales& scales,
              const SmoothParameters& parameters);

/// Whether the look may have been at `h`.
bool explains(const Hypothesis& h, const Keyframe& look, const BoxParameters& parameters);

/// What two objects that are one remember, in order of time.
void joinKeyframes(Object& a, const Object& b, const ViewScales& scales,
                   const SmoothParameters& parameters);

}  // namespace perdure::semantic_filter
