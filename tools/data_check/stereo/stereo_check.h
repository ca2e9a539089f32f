// Whether the images of two cameras fit what the calibration says of the two: what one of them sees
// lies on its epipolar line in the other, and before both (Hartley & Zisserman, Multiple View
// Geometry, 2nd ed., chapter 9).
#pragma once

#include "common/replay/data_check.h"

namespace perdure::tools {

/// Looks at up to eight pairs of cam0 and cam1. Codes: stereo_same_images, stereo_same_place,
/// stereo_flipped, stereo_unmatched, stereo_stamps, stereo_epipolar, stereo_turned,
/// stereo_wrong_side. Nothing where there is one camera, or too little can be matched.
replay::DataFindings checkStereo(const replay::Recording& recording);

}  // namespace perdure::tools
