// Estimates the offset (of any size) and the rate between the clocks of camera and IMU. It compares
// the rotation of images from the whole drive with that of the gyroscope at every shift.
#pragma once

#include <optional>

#include "common/replay/data_check.h"
#include "tools/data_check/clock_parts.h"
#include "tools/data_check/motion_check.h"

namespace perdure::tools {

/// Returns t_imu − t_image in s, if the gyroscope explains the rotation of the images at this
/// shift, and twice as well as at any other shift. `turns`: rotations from all parts of the drive.
std::optional<double> shiftOfTurns(const std::vector<Turn>& turns,
                                   const std::vector<ImuSample>& samples,
                                   const CameraCalibration& camera);

/// Returns the share by which the IMU's clock runs faster than the camera's. Returns nothing unless
/// the gyroscope then explains the images' rotation, and twice as well as at any constant shift.
std::optional<double> rateOfTurns(const std::vector<Turn>& turns,
                                  const std::vector<ImuSample>& samples,
                                  const CameraCalibration& camera);

/// Returns the finding with code clock_rate; `rate`: the result of rateOfTurns.
replay::DataFindings rateFinding(double rate, const CameraCalibration& camera);

/// Whether the gyroscope explains the images' rotation if they are played backwards between the
/// stamps `first` and `last`.
bool areBackwards(const std::vector<Turn>& turns, const std::vector<ImuSample>& samples,
                  const CameraCalibration& camera, TimePoint first, TimePoint last);

/// Reads images from all parts of the drive. Returns the time in s to add to the image stamps, or
/// nothing if no shift of over a second is certain.
std::optional<double> shiftOfClocks(const replay::Recording& recording);

/// Reads images from all parts of the drive. Codes: clock_shift, clock_rate, clock_step.
/// `parts`, `known`: offsets and rotations that are known already.
replay::DataFindings checkClockLine(const replay::Recording& recording,
                                    std::vector<PartOffset> parts, KnownTurns& known);

/// Reads images from all parts of the drive. Code: images_backwards.
replay::DataFindings checkBackwards(const replay::Recording& recording, KnownTurns& known);

/// Returns the finding with code clock_shift.
replay::DataFindings shiftFinding(double shift_s, const CameraCalibration& camera);

/// Adds the shift to the stamps of all images.
void shiftImages(double shift_s, replay::Recording& recording);

}  // namespace perdure::tools
