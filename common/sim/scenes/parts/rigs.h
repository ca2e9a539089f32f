// The sensors of the bodies in the scenes.
#pragma once

#include "common/sim/dice.h"
#include "common/sim/scene.h"

namespace perdure::sim {

enum class Carrier { kVehicle, kHand };

/// Cameras (two if options.stereo: 0.5 m apart on a vehicle, 0.12 m if handheld), IMU, and a
/// vehicle's speed sensor. `pitch_down` is the camera's tilt in the body, radians.
Rig makeRig(Carrier carrier, const SceneOptions& options, Dice& dice, double pitch_down);

/// Height of the camera above the body's origin, metres.
inline constexpr double kCameraAboveBody = 0.05;
/// Distance of the camera in front of the body's origin, metres.
inline constexpr double kCameraBeforeBody = 0.06;

}  // namespace perdure::sim
