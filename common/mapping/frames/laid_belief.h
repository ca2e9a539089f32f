// Transforms beliefs about objects between level frames.
#pragma once

#include "common/types/map.h"
#include "common/types/objects.h"
#include "common/types/odometry.h"

namespace perdure::mapping {

/// Transforms a belief from frame B into frame A. The z axes of both point against gravity.
ObjectBelief turned(const RigidTransform& T_AB, ObjectBelief belief);
/// Transforms a published map object likewise. Its `world` is unchanged.
MapObject turned(const RigidTransform& T_AB, MapObject object);

/// Removes the part of the covariances that the pose error explains. `P_pose` is the covariance of
/// the pose error when the object was last detected. The result is relative to the body, with
/// cross_pose zero.
ObjectBelief relativeToBody(ObjectBelief belief, const Matrix6d& P_pose);

/// Adds the error of the source frame to the belief. `covariance` is that of [δp, δyaw] in m and
/// rad, with rotation about `about`.
ObjectBelief withFrameError(ObjectBelief belief, const Eigen::Matrix4d& covariance,
                            const Eigen::Vector3d& about);

}  // namespace perdure::mapping
