// The sensors on the bodies of the scenes.
#pragma once

#include "common/sim/dice.h"
#include "common/sim/scene.h"

namespace perdure::sim {

enum class Carrier { kVehicle, kHand };

/// Cameras (two with options.stereo: 0.5 m apart on a vehicle, 0.12 m if handheld), IMU, and the
/// speed of a vehicle. `pitch_down` is the camera's tilt in the body, radians.
Rig makeRig(Carrier carrier, const SceneOptions& options, Dice& dice, double pitch_down);

/// Height of the camera above the body's origin.
inline constexpr double kCameraAboveBody = 0.05;
/// Distance of the cameras in front of the body's origin.
inline constexpr double kCameraBeforeBody = 0.06;

}  // namespace perdure::sim
