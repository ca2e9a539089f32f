// Checks whether the images of a drive's cameras exist, form pairs, and have a plausible extrinsic
// calibration.
#pragma once

#include "common/replay/data_check.h"

namespace perdure::tools {

/// Codes: images_missing (listed files do not exist), stereo_unpaired (frames of cam0 have no
/// partner from cam1), T_BS_in_mm.
replay::DataFindings checkPairs(const replay::Recording& recording);

/// Whether the camera's distance from the IMU in T_BS exceeds that of real rigs.
bool hasPlaceInMm(const CameraCalibration& camera);

}  // namespace perdure::tools
