// Keyframes of a track: observations that are kept for the batch estimate (Dellaert, Kaess 2017).
// Derivation: tools/docs/maths/map_fit.md.
//
// A filter that linearised at a wrong first depth, or that took the visible part of an object for
// the whole, stays wrong. A fit to all keyframes does not.
#pragma once

#include "services/semantic_filter/core/belief/track.h"
#include "services/semantic_filter/core/measurement/frame.h"

namespace perdure::semantic_filter {

/// Adds the keyframe if its view differs from those of all others. When there are more than
/// `parameters.keyframes`, the one that is most similar to another goes, but never the newest.
/// Returns whether the keyframe was added.
bool addKeyframe(Track& track, Keyframe keyframe, const ViewScales& scales,
                 const SmoothingParameters& parameters);

/// Whether the box of the keyframe fits the hypothesis.
bool explains(const Hypothesis& h, const Keyframe& keyframe, const BoxParameters& parameters);

/// Adds the keyframes of b to those of a. Both tracks are one object.
void mergeBatches(Track& a, const Track& b, const ViewScales& scales,
                  const SmoothingParameters& parameters);

}  // namespace perdure::semantic_filter
