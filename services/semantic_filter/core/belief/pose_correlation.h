// Correlation of a hypothesis with the pose error, which is a consider state (Schmidt 1966).
// Derivation: tools/docs/maths/pose_error.md.
#pragma once

#include <optional>

#include "services/semantic_filter/core/belief/track.h"

namespace perdure::semantic_filter {

/// Returns the transition of the pose error between two values of PoseError::product; nothing if
/// `earlier` has no usable inverse.
std::optional<Matrix6d> transitionBetween(const Matrix6d& earlier, const Matrix6d& later);

/// Whether [P C; Cᵀ P_pose] is a covariance.
bool isJointCovariance(const Hypothesis& h, const Matrix6d& P_pose);

/// Scales C down until [P C; Cᵀ P_pose] is a covariance. `L_pose`: Cholesky factor of P_pose.
void keepConsistent(Hypothesis& h, const Matrix6d& P_pose, const std::optional<Matrix6d>& L_pose);

/// Adds the error of the body's pose to a state that is known relative to the body: δp = p - R_WB
/// [p_B]x θ, δψ = up · R_WB θ. C becomes the cross-covariance with this error alone.
void addPoseError(Hypothesis& h, const RigidTransform& T_WB, const Eigen::Vector3d& up_W,
                  const Matrix6d& P_pose);

/// Returns the standard deviation of the position given the pose error, m.
double placeSigma(const Hypothesis& h, const Matrix6d& P_pose);
/// Returns the same for a track, with the distances between its hypotheses.
double placeSigma(const Track& track, const Matrix6d& P_pose);

}  // namespace perdure::semantic_filter
