// Numbers of a rig that cannot be what they stand for, without a look at the recording.
#pragma once

#include "common/replay/data_check.h"

namespace perdure::tools {

/// Codes: intrinsics_unit (fatal: focal lengths that are no pixels of this image), intrinsics_order
/// (a principal point near the border, or focal lengths far apart), time_offset_large,
/// imu_noise_large. Only what does not need the recording.
replay::DataFindings checkRigNumbers(const Calibration& calibration);

}  // namespace perdure::tools
