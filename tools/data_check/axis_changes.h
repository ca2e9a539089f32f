// Whether the gyroscope's axes are those of T_BS: each axis of its own, so that an axis about which
// a car hardly turns is heard beside the one about which it does.
#pragma once

#include "tools/data_check/motion_check.h"

namespace perdure::tools {

/// The turning that is left of each axis without its mean over half a second, in deviations: where
/// this is lively, each axis can be told from the others.
std::vector<ImuSample> livelinessOfAxes(const std::vector<ImuSample>& samples);

/// Whether each axis of the gyroscope plainly turns as the images do about it; then there is
/// nothing that judgeAxisChanges could find.
bool axesSurelyAgree(const std::vector<Turn>& turns, const std::vector<ImuSample>& samples,
                     const CameraCalibration& camera);

/// Compares how turning changes from image to image, which what a camera's own way adds hardly
/// does. Code: gyro_axes. Nothing where fewer than 60 changes, or unclear ones, are seen.
replay::DataFindings judgeAxisChanges(const std::vector<Turn>& turns,
                                      const std::vector<ImuSample>& samples,
                                      const CameraCalibration& camera);

}  // namespace perdure::tools
