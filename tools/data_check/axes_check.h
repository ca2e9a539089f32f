// Checks whether axes of the gyroscope are exchanged or have the wrong sign as a mirror image,
// which no T_BS can represent.
#pragma once

#include <vector>

#include "common/replay/data_check.h"
#include "tools/data_check/motion_check.h"

namespace perdure::tools {

/// Code: gyro_axes. Each axis of the body is judged separately, so that an axis with little
/// rotation counts too. Returns nothing if the rotation is too small.
replay::DataFindings judgeAxes(const std::vector<Turn>& turns,
                               const std::vector<ImuSample>& samples,
                               const CameraCalibration& camera);

}  // namespace perdure::tools
