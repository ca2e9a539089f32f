// Compares two calibrations of a camera.
#pragma once

#include "common/types/sensors.h"

namespace perdure {

/// Returns true if name, size, lens, pose on the body and times are exactly equal. The nominal rate
/// may differ.
bool sameCamera(const CameraCalibration& a, const CameraCalibration& b);

}  // namespace perdure
