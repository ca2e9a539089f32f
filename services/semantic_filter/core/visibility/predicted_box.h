// Where tracks should be seen: what primes inference (eq. 7: b = π(g s), a Gaussian in the four
// sides of the box).
#pragma once

#include <optional>

#include "services/semantic_filter/core/belief/track.h"
#include "services/semantic_filter/core/measurement/frame.h"

namespace perdure::semantic_filter {

/// The view that is expected next.
struct ComingFrame {
  View view;
  double seconds = 0.0;  ///< after the present one
};

/// The box that the network should report of the track in this frame, with how its sides move
/// towards `coming`; nothing where r·π·v is under 0.05, or nothing of it lies before the camera.
std::optional<Prediction> predictionOf(const Track& track, const FrameInput& now,
                                       const std::optional<ComingFrame>& coming);

}  // namespace perdure::semantic_filter
