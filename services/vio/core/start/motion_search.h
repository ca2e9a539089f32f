// The best minimum of a window in motion (motion_refinement.h): searched for from two places, with
// the noise that the images are seen to have. Derivation: tools/docs/maths/vio-starts.md.
#pragma once

#include "services/vio/core/start/motion_refinement.h"

namespace perdure::vio {

/// A velocity is usable where it is known to this share of the largest in the window, and no other
/// minimum that fits about as well is further off.
inline constexpr double kVelocityShare = 0.16;

/// Places the points where their rays meet, from the poses of the window.
void placePoints(MotionWindow& window);

/// Fails as refine() does, and with "start_unobservable" where another minimum fits about as well.
Result<RefinedWindow> searchMinimum(MotionWindow window, const ImuBuffer& imu,
                                    const Options& options);

}  // namespace perdure::vio
