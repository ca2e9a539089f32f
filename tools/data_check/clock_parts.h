// Compares the clocks of camera and IMU in each part of a drive: the time offset of each part
// reveals a clock that was set by less than a second, or that runs slightly too fast.
#pragma once

#include <optional>
#include <string>

#include "common/replay/data_check.h"
#include "tools/data_check/motion_check.h"

namespace perdure::tools {

/// The offset t_imu − t_image at which the gyroscope explains the images of a part of the drive.
struct PartOffset {
  TimePoint from, to;  ///< stamps of the first and the last image
  double offset_s = 0.0, sigma_s = 0.0;
};

/// Offsets within 0.4 s of the camera's own, for parts of consecutive turns. Omits parts whose
/// rotation is too small, too uniform or not explained.
std::vector<PartOffset> offsetsOfParts(const std::vector<Turn>& turns,
                                       const std::vector<ImuSample>& samples,
                                       const CameraCalibration& camera);

/// Whether two offsets differ clearly, by over 12 ms.
bool offsetsDiffer(const std::vector<PartOffset>& parts);
/// Whether these offsets differ from one another, or one of them from that of the calibration.
bool offsetsDiffer(std::vector<PartOffset> parts, const CameraCalibration& camera);

/// Whether an interval of the stamps is so long or short that one of the clocks may have been set.
bool hasStampStep(const replay::Recording& recording);

/// Codes: clock_step (one change of the offset, with its place), clock_rate (the offset changes
/// evenly). Returns nothing unless one of them explains the offsets. Smaller changes than
/// `least_s` are not reported, except for steps in the stamps; by default a third of the usual
/// interval of the images.
replay::DataFindings judgeParts(std::vector<PartOffset> parts, const replay::Recording& recording,
                                std::optional<double> least_s = {});

/// Jumps of the stamps that may be clocks that were set, as text; empty if there are none. Omits
/// lost images, whose intervals are whole multiples.
std::string suspectJumps(const replay::Recording& recording);

/// Code: imu_gap. Inertial samples are missing for over 0.2 s and 20 intervals between images.
replay::DataFindings checkImuGaps(const replay::Recording& recording);

}  // namespace perdure::tools
