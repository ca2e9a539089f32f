// Compares two calibrations of a camera.
#pragma once

#include "common/types/sensors.h"

namespace perdure {

/// True if name, size, lens, pose and times are equal. The nominal rate may differ.
bool sameCamera(const CameraCalibration& a, const CameraCalibration& b);

}  // namespace perdure
