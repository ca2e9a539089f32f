// Checks whether the axes of the gyroscope match those of T_BS. Each axis is judged separately,
// because a car hardly rotates about two of them.
#pragma once

#include "tools/data_check/motion_check.h"

namespace perdure::tools {

/// Rotation rate of each axis in standard deviations, without its mean over half a second. Large
/// values allow a distinction of the axes.
std::vector<ImuSample> livelinessOfAxes(const std::vector<ImuSample>& samples);

/// Correlation of changes of the rotation rate between images: of each axis of the images in B
/// (rows) with each axis of the gyroscope (columns).
struct AxisCorrelation {
  Eigen::Matrix3d of = Eigen::Matrix3d::Zero();
  std::size_t count = 0;  ///< number of changes
};
AxisCorrelation correlationOfAxes(const std::vector<Turn>& turns,
                                  const std::vector<ImuSample>& samples,
                                  const CameraCalibration& camera);

/// Whether each axis of the gyroscope clearly correlates with the same axis of the images. If so,
/// judgeAxisChanges cannot find a fault.
bool axesSurelyAgree(const std::vector<Turn>& turns, const std::vector<ImuSample>& samples,
                     const CameraCalibration& camera);

/// Compares changes of the rotation rate between images; the camera's translation hardly affects
/// these changes. Code: gyro_axes. Returns nothing for fewer than 60 changes or unclear
/// correlations.
replay::DataFindings judgeAxisChanges(const std::vector<Turn>& turns,
                                      const std::vector<ImuSample>& samples,
                                      const CameraCalibration& camera);

}  // namespace perdure::tools
