// Whether what the cameras of a drive took is there, image by image, and where they sit.
#pragma once

#include "common/replay/data_check.h"

namespace perdure::tools {

/// Codes: images_missing (files that the list names), stereo_unpaired (frames of cam0 without one
/// of cam1), T_BS_in_mm.
replay::DataFindings checkPairs(const replay::Recording& recording);

/// Whether T_BS has the camera farther from the IMU than rigs are large.
bool hasPlaceInMm(const CameraCalibration& camera);

}  // namespace perdure::tools
