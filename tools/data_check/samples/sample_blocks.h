// Finds short blocks of corrupt inertial samples: a sensor jumps to a value, keeps it for some
// samples and jumps back, while the other sensor shows no shock and, for the gyroscope, the images
// do not turn.
#pragma once

#include "common/replay/data_check.h"

namespace perdure::tools {

/// Code: imu_block. Names time, numbers of the samples, axes and value of the first block.
replay::DataFindings checkSampleBlocks(const replay::Recording& recording);

}  // namespace perdure::tools
