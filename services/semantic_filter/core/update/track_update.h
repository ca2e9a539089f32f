// Update of a track by one frame: PMF, existence and the EKF of each hypothesis, all from the same
// A (paper, eq. 4 and 9). Derivation: tools/docs/maths/class_and_existence_update.md.
//
//   A_k = 1 - v P_Dk + v P_Dk Σ_z η_j(z) L_k(z),   π_k ∝ π_k A_k,   r ← r Ā / (1 - r + r Ā)
//
// The EKF of hypothesis k weighs box z by v P_Dk η_j(z) L_k(z) / A_k. No other rule updates class
// or existence by boxes. An observation whose errors are correlated with earlier ones counts with
// an exponent τ <= 1 in PMF and existence; in the EKF its noise is widened
// (tools/docs/maths/ekf.md).
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "services/semantic_filter/core/association/score.h"

namespace perdure::semantic_filter {

/// A row of Association::eta.
using EtaRow = Eigen::Ref<const Eigen::RowVectorXd, 0, Eigen::InnerStride<>>;

/// Updates one track; does nothing at v = 0 (score.visibility.fraction). `eta`: the track's row of
/// Association::eta, one number for each box of the frame. Returns the index of the box that is
/// assigned to the track, if there is one.
std::optional<std::size_t> update(Track& track, const TrackScore& score, const EtaRow& eta,
                                  const std::vector<BoxDetection>& boxes,
                                  const FrameContext& frame);

/// Returns the factor on the noise of a box whose noise repeats that of the last detection. It is
/// that of a stationary first-order process whose correlation falls with the view change.
double noiseRepetition(const Track& track, const FrameContext& frame);

/// Returns the track as the same frame would leave it if none of the boxes were the track's.
Track updateAsMissed(Track track, TrackScore score, const FrameContext& frame);

}  // namespace perdure::semantic_filter
