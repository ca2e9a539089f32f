// The sensors on the bodies of the scenes.
#pragma once

#include "common/sim/dice.h"
#include "common/sim/scene.h"

namespace perdure::sim {

enum class Carrier { kVehicle, kHand };

/// Cameras (two with options.stereo), IMU, speed of a vehicle. `pitch_down`: tilt, radians.
Rig makeRig(Carrier carrier, const SceneOptions& options, Dice& dice, double pitch_down);

/// Height of the camera above the body's origin.
inline constexpr double kCameraAboveBody = 0.05;
/// Distance of the cameras in front of the body's origin.
inline constexpr double kCameraBeforeBody = 0.06;

}  // namespace perdure::sim
