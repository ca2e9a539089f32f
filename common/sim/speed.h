// Simulates the wheel speed of a vehicle: the speed of the body's origin along its x axis.
#pragma once

#include <vector>

#include "common/sim/scene.h"
#include "common/sim/trajectory.h"
#include "common/types/sensors.h"

namespace perdure::sim {

/// Samples from the scene's t = 0 until `seconds`; `epoch` is the sensor time of t = 0.
std::vector<SpeedSample> simulateSpeed(const Trajectory& body, const SpeedErrors& errors,
                                       std::uint64_t seed, double seconds, TimePoint epoch);

}  // namespace perdure::sim
