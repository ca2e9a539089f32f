// How the error of the body's pose grows from frame to frame: the consider state of the filter.
// Derivation: tools/docs/maths/pose_error.md.
#pragma once

#include <optional>

#include "common/math/rigid_transform.h"
#include "common/types/odometry.h"
#include "services/semantic_filter/core/measurement/frame.h"
#include "services/semantic_filter/core/parameters.h"

namespace perdure::semantic_filter {

/// Brings `error` from the frame before to the frame of `odometry`. `last_T_WB`: pose of the frame
/// before; without one a walk adds nothing.
void advancePoseError(PoseError& error, const Odometry& odometry,
                      const std::optional<RigidTransform>& last_T_WB,
                      const PoseParameters& parameters);

}  // namespace perdure::semantic_filter
