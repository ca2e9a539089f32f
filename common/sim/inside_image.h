// The part of an object's outline that lies within the image.
#pragma once

#include "common/camera/camera_model.h"
#include "common/math/rigid_transform.h"
#include "common/sim/truth.h"

namespace perdure::sim {

/// Returns the box around what of the outline lies within the image. Where the border cuts the
/// object, that is less than the part of its box within the image: its other two sides are those of
/// its cuboid inside, at the same share of the box. The box is empty if nothing is inside.
Box partInsideImage(const TruthView& view, const TruthObject& object, const TruthKey& at,
                    const RigidTransform& T_CW, const CameraModel& camera);

}  // namespace perdure::sim
