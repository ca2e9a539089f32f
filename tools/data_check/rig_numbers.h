// Finds numbers of a rig that are impossible for any recording.
#pragma once

#include "common/replay/data_check.h"

namespace perdure::tools {

/// Codes: intrinsics_unit (fatal: focal lengths that are not pixels of this image),
/// intrinsics_order (a principal point near the border, or very different focal lengths),
/// lens_folds (fatal if most of the image folds), time_offset_large, readout_large,
/// imu_noise_large, imu_noise_zero.
replay::DataFindings checkRigNumbers(const Calibration& calibration);

}  // namespace perdure::tools
