// Beliefs of objects in another level frame.
#pragma once

#include "common/types/map.h"
#include "common/types/objects.h"
#include "common/types/odometry.h"

namespace perdure::mapping {

/// Transforms a belief from frame B into frame A; both are level.
ObjectBelief turned(const RigidTransform& T_AB, ObjectBelief belief);
/// The same of what the map shows of it. `world` stays as it is.
MapObject turned(const RigidTransform& T_AB, MapObject object);

/// Takes out of the covariances what the error of the pose explains, whose covariance was P_pose
/// when the object was last detected: what is left is known relative to the body. cross_pose is
/// then zero.
ObjectBelief relativeToBody(ObjectBelief belief, const Matrix6d& P_pose);

/// Adds the error of the frame that a belief was brought from, [δp, δyaw] of m and rad, turning
/// about `about`.
ObjectBelief withFrameError(ObjectBelief belief, const Eigen::Matrix4d& covariance,
                            const Eigen::Vector3d& about);

}  // namespace perdure::mapping
