// Checks whether the images of two cameras match their calibration. A point in one image must be on
// its epipolar line in the other, and in front of both cameras. Source: Hartley & Zisserman,
// Multiple View Geometry, 2nd ed., chapter 9.
#pragma once

#include "common/replay/data_check.h"

namespace perdure::tools {

/// Examines up to eight image pairs of cam0 and cam1. Codes: stereo_same_images, stereo_same_place,
/// stereo_flipped, stereo_unmatched, stereo_stamps, stereo_epipolar, stereo_turned,
/// stereo_wrong_side. Returns nothing for a single camera or too few matches.
replay::DataFindings checkStereo(const replay::Recording& recording);

}  // namespace perdure::tools
