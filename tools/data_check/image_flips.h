// Recognises mirrored and inverted images by the axes about which they turn against the gyroscope.
#pragma once

#include "tools/data_check/motion_check.h"

namespace perdure::tools {

/// Code: images_flipped. An image that is mirrored turns against the gyroscope about two axes of
/// the camera: about all except x, if left and right are exchanged, and about all except z, if it
/// is upside down. Returns nothing if no such pattern fits.
replay::DataFindings judgeFlips(const std::vector<Turn>& turns,
                                const std::vector<ImuSample>& samples,
                                const CameraCalibration& camera);

}  // namespace perdure::tools
