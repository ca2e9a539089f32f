// `perdure calibrate import`: converts calibrations of other programs to a rig file.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/types/sensors.h"

namespace perdure::calibrate {

struct ImportedRig {
  Calibration rig;
  std::vector<std::string> found;    ///< the kind of each file, for people
  std::vector<std::string> ignored;  ///< unknown keys
};

/// Imports Kalibr's camchain and imu files, ROS camera_info, EuRoC's sensor.yaml, files of VINS,
/// ORB-SLAM3 and Basalt, or a rig file. `T_BC`: poses of the cameras whose files have none, in
/// their order. Throws StartupError with the cause.
ImportedRig importRig(const std::vector<std::filesystem::path>& files,
                      const std::vector<RigidTransform>& T_BC = {});

/// Parses 16 numbers, row by row, separated by commas or blanks. Throws StartupError(kUsage).
RigidTransform transformOf(const std::string& text);

}  // namespace perdure::calibrate
