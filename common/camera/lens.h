// Distortion models by their names in EuRoC, Kalibr, OpenCV and ROS.
#pragma once

#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/types/sensors.h"

namespace perdure {

/// Sets model and coefficients. The reason names the invalid item, `distortion_model` or
/// `distortion_coefficients`; the detail continues the sentence that begins with that name.
Result<void> setLens(CameraCalibration& camera, const std::string& model,
                     std::vector<double> coefficients);

}  // namespace perdure
