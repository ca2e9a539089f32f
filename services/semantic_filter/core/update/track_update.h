// Update, once each, from the same A (DESIGN 5, item 6; eq. 4 and 9 of the paper):
//   A_k = 1 - v P_Dk + v P_Dk Σ_z η_j(z) L_k(z),   π_k ∝ π_k A_k,   r ← r Ā / (1 - r + r Ā),
// and the EKF of hypothesis k weighs box z by v P_Dk η_j(z) L_k(z) / A_k.
// There is no other rule for class or existence. KeyframeBatch that are correlated with earlier
// ones enter with an exponent τ <= 1, and with R / τ in the EKF.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "services/semantic_filter/core/association/score.h"

namespace perdure::semantic_filter {

/// Everything at once for one track that can be detected (score.visibility.fraction > 0). `eta` is
/// the track's row of Association::eta, by the frame's boxes. Does nothing at v = 0. Returns the
/// box that is surely its assigned.
std::optional<std::size_t> update(Track& track, const TrackScore& score, const Eigen::VectorXd& eta,
                                  const std::vector<BoxDetection>& boxes,
                                  const FrameContext& frame);

/// The track after the same score, had none of its boxes been the track's.
Track updateAsMissed(Track track, TrackScore score, const FrameContext& frame);

}  // namespace perdure::semantic_filter
