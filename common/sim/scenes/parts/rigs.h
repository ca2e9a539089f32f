// The sensors that the scenes' bodies carry.
#pragma once

#include "common/sim/dice.h"
#include "common/sim/scene.h"

namespace perdure::sim {

enum class Carrier { kVehicle, kHand };

/// Camera (two with options.stereo: 0.5 m apart on a vehicle, 0.12 m in the hand), IMU, and a
/// vehicle's speed. `pitch_down` is the camera's tilt in the body, radians.
Rig makeRig(Carrier carrier, const SceneOptions& options, Dice& dice, double pitch_down);

/// Height of the camera above the body's origin.
inline constexpr double kCameraAboveBody = 0.05;
/// And before it; with two cameras each is half of the baseline to its side.
inline constexpr double kCameraBeforeBody = 0.06;

}  // namespace perdure::sim
