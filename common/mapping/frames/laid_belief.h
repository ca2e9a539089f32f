// Transforms beliefs about objects between level frames.
#pragma once

#include "common/types/map.h"
#include "common/types/objects.h"
#include "common/types/odometry.h"

namespace perdure::mapping {

/// Transforms a belief from frame B into frame A; both are level.
ObjectBelief turned(const RigidTransform& T_AB, ObjectBelief belief);
/// The same transform for a published map object. `world` is unchanged.
MapObject turned(const RigidTransform& T_AB, MapObject object);

/// Removes the part of the covariances that the pose error explains. P_pose is the covariance of
/// that error when the object was last detected. The remaining covariance is relative to the body,
/// and cross_pose is zero.
ObjectBelief relativeToBody(ObjectBelief belief, const Matrix6d& P_pose);

/// Adds the error of the source frame, [δp, δyaw] in m and rad, with a rotation about `about`.
ObjectBelief withFrameError(ObjectBelief belief, const Eigen::Matrix4d& covariance,
                            const Eigen::Vector3d& about);

}  // namespace perdure::mapping
