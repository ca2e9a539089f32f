// Numbers of a rig that cannot be what they stand for, without a look at the recording.
#pragma once

#include "common/replay/data_check.h"

namespace perdure::tools {

/// Codes: intrinsics_unit (fatal: focal lengths that are no pixels of this image), intrinsics_order
/// (a principal point near the border, or focal lengths far apart), lens_folds (fatal where most of
/// the image does), time_offset_large, readout_large, imu_noise_large, imu_noise_zero. Only what does not need the recording.
replay::DataFindings checkRigNumbers(const Calibration& calibration);

}  // namespace perdure::tools
