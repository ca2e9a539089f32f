// Finds the best minimum of a window in motion (motion_refinement.h). The search begins from at
// least two initial values and uses the noise estimated from the images. Derivation:
// tools/docs/maths/vio-starts.md.
#pragma once

#include "services/vio/core/start/motion_refinement.h"

namespace perdure::vio {

/// Largest error of a usable velocity, as a share of the largest velocity in the window. The same
/// limit applies to the distance of other minima that fit about as well.
inline constexpr double kVelocityShare = 0.16;

/// Triangulates the points from the poses of the window.
void placePoints(MotionWindow& window);

/// Fails as refine() does, and with "start_unobservable" if another minimum fits about as well.
Result<RefinedWindow> searchMinimum(MotionWindow window, const ImuBuffer& imu,
                                    const Options& options);

}  // namespace perdure::vio
