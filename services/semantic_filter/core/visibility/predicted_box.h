// Predicted measurement that inference evaluates: a Gaussian in the four sides of the box (paper,
// eq. 7: b = π(g s)). Derivation: tools/docs/maths/joint_association.md, "Top-down likelihood".
#pragma once

#include <optional>

#include "services/semantic_filter/core/belief/track.h"
#include "services/semantic_filter/core/measurement/frame.h"

namespace perdure::semantic_filter {

struct ComingFrame {
  View view;
  double seconds = 0.0;  ///< time after the present frame
};

/// Returns the box that the network should report, with the velocity of its sides (px/s) towards
/// `coming`; nothing if r·π·v is below 0.05 or the object is not in front of the camera.
std::optional<Prediction> predictionOf(const Track& track, const FrameInput& now,
                                       const std::optional<ComingFrame>& coming);

}  // namespace perdure::semantic_filter
