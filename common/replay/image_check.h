// Checks whether a recording's images are readable and match the calibration.
#pragma once

#include "common/replay/data_check.h"

namespace perdure::replay {

/// Checks the size of each file of the camera, and the pixels of some images.
void checkImages(const Recording& recording, std::size_t camera, DataFindings& findings);

}  // namespace perdure::replay
