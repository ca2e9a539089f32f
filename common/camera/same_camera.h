// Whether two calibrations are of one camera.
#pragma once

#include "common/types/sensors.h"

namespace perdure {

/// Name, size, lens, place on the body and times, to the last digit. The nominal rate may differ.
bool sameCamera(const CameraCalibration& a, const CameraCalibration& b);

}  // namespace perdure
