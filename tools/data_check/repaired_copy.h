// Implements `perdure doctor --data DRIVE --fix FOLDER`: copies a drive and fixes every certain
// fault.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "common/replay/data_check.h"

namespace perdure::tools {

struct RepairedDrive {
  replay::Recording recording;
  std::vector<std::string> fixes;  ///< one sentence for each fix
  replay::DataFindings left;       ///< findings that remain
};

/// Fixes in memory the certain faults among the findings, and checks the drive again after each
/// fix. These are wrong units of forces (accel_in_g, accel_in_mg, accel_in_mm) and of rates
/// (gyro_in_degrees), exchanged columns (imu_columns_exchanged), and an inverted T_BS of cam0
/// (T_BS_inverted).
RepairedDrive repairDrive(replay::Recording recording);

/// Reports progress: `done` of `all` images are written.
using CopyProgress = std::function<void(std::size_t done, std::size_t all)>;

/// Writes the layout of EuRoC: mav0 with cam0, cam1, imu0 and speed0. Rows are sorted, with one row
/// per stamp, in nanoseconds. Image files are named by their stamps and copied unchanged;
/// uncompressed images of a recording become PNG. Returns the number of unreadable images, which
/// are omitted. Ground truth is not copied.
///
/// Throws StartupError: kUsage if `folder` exists and is not empty, or is inside the drive; kData
/// if a recording has no images and no samples; kInputOutput if the disk reports an error.
std::size_t writeDrive(const replay::Recording& recording, const std::filesystem::path& folder,
                       const CopyProgress& progress = {});

}  // namespace perdure::tools
