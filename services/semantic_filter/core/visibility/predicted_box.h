// Predicted measurement for inference: a Gaussian in the four sides of the box (paper, eq. 7).
// Derivation: tools/docs/maths/joint_association.md, "Top-down likelihood".
#pragma once

#include <optional>

#include "services/semantic_filter/core/belief/track.h"
#include "services/semantic_filter/core/measurement/frame.h"

namespace perdure::semantic_filter {

struct ComingFrame {
  View view;
  double seconds = 0.0;  ///< after the present one
};

/// The expected box with the velocity of its sides (px/s); nothing if r·π·v is below 0.05.
std::optional<Prediction> predictionOf(const Track& track, const FrameInput& now,
                                       const std::optional<ComingFrame>& coming);

}  // namespace perdure::semantic_filter
