// Models of distortion by the names that EuRoC, Kalibr, OpenCV and ROS have for them.
#pragma once

#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/types/sensors.h"

namespace perdure {

/// Sets model and coefficients. Reasons are what is wrong, `distortion_model` or
/// `distortion_coefficients`; the detail goes on the sentence that begins with it.
Result<void> setLens(CameraCalibration& camera, const std::string& model,
                     std::vector<double> coefficients);

}  // namespace perdure
