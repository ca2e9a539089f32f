// Update, once each, from the same A (DESIGN 5, item 6; eq. 4 and 9 of the paper):
//   A_k = 1 - v P_Dk + v P_Dk Σ_z η_j(z) L_k(z),   π_k ∝ π_k A_k,   r ← r Ā / (1 - r + r Ā),
// and the EKF of hypothesis k weighs box z by v P_Dk η_j(z) L_k(z) / A_k.
// There is no other rule for class or existence. Looks that are correlated with earlier ones enter
// with an exponent τ <= 1, and with R / τ in the EKF.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "services/semantic_filter/core/association/score.h"

namespace perdure::semantic_filter {

/// Everything at once for one object that can be seen (look.sight.fraction > 0). `eta` is the
/// object's row of Association::eta, by the frame's boxes. Does nothing at v = 0. Returns the box
/// that is surely its own.
std::optional<std::size_t> update(Object& object, const ObjectLook& look,
                                  const Eigen::VectorXd& eta, const std::vector<Evidence>& boxes,
                                  const FrameContext& frame);

/// The object after the same look, had none of its boxes been the object's.
Object missed(Object object, ObjectLook look, const FrameContext& frame);

}  // namespace perdure::semantic_filter
