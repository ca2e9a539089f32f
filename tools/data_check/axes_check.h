// Checks whether the gyroscope's axes are mirrored: exchanged or negated, so that no T_BS can
// describe them.
#pragma once

#include <vector>

#include "common/replay/data_check.h"
#include "tools/data_check/motion_check.h"

namespace perdure::tools {

/// Code: gyro_axes. Judges each axis of the body separately, so that an axis with little rotation
/// counts too. Returns nothing if the rotation is too small.
replay::DataFindings judgeAxes(const std::vector<Turn>& turns,
                               const std::vector<ImuSample>& samples,
                               const CameraCalibration& camera);

/// Code: gyro_axis_constant. An axis of the gyroscope that never changes although the images turn
/// about it.
replay::DataFindings judgeConstantAxis(const std::vector<Turn>& turns,
                                       const std::vector<ImuSample>& samples,
                                       const CameraCalibration& camera);

/// Code: gyro_axis_factor. An axis of the gyroscope whose scale is wrong by over 15 %.
replay::DataFindings judgeAxisFactors(const std::vector<Turn>& turns,
                                      const std::vector<ImuSample>& samples,
                                      const CameraCalibration& camera);

}  // namespace perdure::tools
