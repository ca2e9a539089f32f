// What a hypothesis has in common with the error of the pose that it is seen from.
#pragma once

#include <optional>

#include "services/semantic_filter/core/belief/track.h"

namespace perdure::semantic_filter {

/// The transition of the pose error between two products of transitions. vio's updates make the
/// products small, so that the inverse may lose its sense: then nothing.
std::optional<Matrix6d> transitionBetween(const Matrix6d& earlier, const Matrix6d& later);

/// Whether [P C; Cᵀ P_pose] is a covariance.
bool isJointCovariance(const Hypothesis& h, const Matrix6d& P_pose);

/// [P C; Cᵀ P_pose] must stay a covariance: C is scaled down where the pose would explain more of P
/// than there is. `L_pose`: Cholesky factor of P_pose, where it has one.
void keepConsistent(Hypothesis& h, const Matrix6d& P_pose, const std::optional<Matrix6d>& L_pose);

/// Standard deviation of the place relative to the body, metres: what the pose error does not
/// share.
double placeSigma(const Hypothesis& h, const Matrix6d& P_pose);
/// The same of an track: of its hypotheses, and by how far they are from each other.
double placeSigma(const Track& track, const Matrix6d& P_pose);

}  // namespace perdure::semantic_filter
