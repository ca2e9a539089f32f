// `perdure doctor --data DRIVE --fix FOLDER`: a copy of a drive with what is sure mended.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "common/replay/data_check.h"

namespace perdure::tools {

struct MendedDrive {
  replay::Recording recording;
  std::vector<std::string> mends;  ///< what was done, a sentence each
  replay::DataFindings left;       ///< what is still found
};

/// Mends in memory what a finding is sure of: the units of forces (accel_in_g, accel_in_mg,
/// accel_in_mm) and of rates (gyro_in_degrees), columns that are exchanged (imu_columns_exchanged),
/// and T_BS of cam0 given the wrong way round (T_BS_inverted). Looks again after each.
MendedDrive mendDrive(replay::Recording recording);

/// How many of the images are written.
using CopyProgress = std::function<void(std::size_t done, std::size_t all)>;

/// Writes EuRoC's layout: mav0 with cam0, cam1, imu0 and speed0, sorted, one stamp a line, in
/// nanoseconds; images as they are (those of a recording that are not compressed as PNG), named by
/// their stamps. Images that cannot be read are left out. Truth is not copied. Returns how many
/// images were left out. Throws StartupError: kUsage where `folder` is there and not
/// empty or lies in the drive, kData
/// where a recording has no images and no samples, kInputOutput where the disk refuses.
std::size_t writeDrive(const replay::Recording& recording, const std::filesystem::path& folder,
                       const CopyProgress& progress = {});

}  // namespace perdure::tools
