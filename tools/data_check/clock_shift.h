// Finds the difference of two clocks of camera and IMU of any size, and of their rates: the turning
// of images from the whole drive is compared with that of the gyroscope at every shift.
#pragma once

#include <optional>

#include "common/replay/data_check.h"
#include "tools/data_check/motion_check.h"

namespace perdure::tools {

/// t_imu − t_image in s, if the gyroscope explains the turning of the images at this shift, and
/// twice as well as at any other one. `turns`: rotations from all parts of the drive.
std::optional<double> shiftOfTurns(const std::vector<Turn>& turns,
                                   const std::vector<ImuSample>& samples,
                                   const CameraCalibration& camera);

/// By how much the clock of the IMU runs faster than that of the camera, as a share, if the
/// gyroscope explains the turning of the images then, and twice as well as with any constant
/// shift.
std::optional<double> rateOfTurns(const std::vector<Turn>& turns,
                                  const std::vector<ImuSample>& samples,
                                  const CameraCalibration& camera);

/// Returns the finding with code clock_rate.
replay::DataFindings rateFinding(double rate, const CameraCalibration& camera);

/// Reads images from places all over the drive, and returns what to add to their stamps. Returns
/// nothing if no shift of over a second is certain.
std::optional<double> shiftOfClocks(const replay::Recording& recording);

/// Reads images from places all over the drive. Codes: clock_shift, clock_rate.
replay::DataFindings checkClockLine(const replay::Recording& recording);

/// Returns the finding with code clock_shift.
replay::DataFindings shiftFinding(double shift_s, const CameraCalibration& camera);

/// Adds the shift to the stamps of all images.
void shiftImages(double shift_s, replay::Recording& recording);

}  // namespace perdure::tools
