// Whether an axis of the gyroscope is exchanged or of the other sign: a mirror image, which no T_BS
// explains.
#pragma once

#include <vector>

#include "common/replay/data_check.h"
#include "tools/data_check/motion_check.h"

namespace perdure::tools {

/// Code: gyro_axes. Each of the body's axes is judged for itself, so that one that turns little
/// counts; nothing where it turns too little to tell.
replay::DataFindings judgeAxes(const std::vector<Turn>& turns,
                               const std::vector<ImuSample>& samples,
                               const CameraCalibration& camera);

}  // namespace perdure::tools
