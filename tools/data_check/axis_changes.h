// Checks whether the axes of the gyroscope match those of T_BS. Each axis is judged separately,
// because a car hardly rotates about two of them.
#pragma once

#include "tools/data_check/motion_check.h"

namespace perdure::tools {

/// Rotation rate of each axis without its mean over half a second, in standard deviations. Where it
/// is large, each axis can be distinguished from the others.
std::vector<ImuSample> livelinessOfAxes(const std::vector<ImuSample>& samples);

/// Whether each axis of the gyroscope clearly correlates with the same axis of the images. Then
/// judgeAxisChanges cannot find a fault.
bool axesSurelyAgree(const std::vector<Turn>& turns, const std::vector<ImuSample>& samples,
                     const CameraCalibration& camera);

/// Compares changes of the rotation rate between images; the camera's translation hardly affects
/// them. Code: gyro_axes. Returns nothing for fewer than 60 changes or unclear correlations.
replay::DataFindings judgeAxisChanges(const std::vector<Turn>& turns,
                                      const std::vector<ImuSample>& samples,
                                      const CameraCalibration& camera);

}  // namespace perdure::tools
