// Whether a recording's images can be read and are what the calibration says.
#pragma once

#include "common/replay/data_check.h"

namespace perdure::replay {

/// Looks at the size of each file of the camera, and at the pixels of some images.
void checkImages(const Recording& recording, std::size_t camera, DataFindings& findings);

}  // namespace perdure::replay
