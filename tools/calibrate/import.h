// `perdure calibrate import`: what Kalibr, ROS or EuRoC have calibrated, as a rig of our own.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "common/types/sensors.h"

namespace perdure::calibrate {

struct ImportedRig {
  Calibration rig;
  std::vector<std::string> found;    ///< what each file was, for people
  std::vector<std::string> ignored;  ///< keys that are not known
};

/// Kalibr's camchain and imu files, ROS' camera_info, EuRoC's sensor.yaml, a rig of ours: cameras
/// in the order in which they come. `T_BC`: the place of cameras whose file does not say it, in
/// that order. Throws StartupError with the file, the key and the mend.
ImportedRig importRig(const std::vector<std::filesystem::path>& files,
                      const std::vector<RigidTransform>& T_BC = {});

/// Of 16 numbers, row by row, with commas or blanks between. Throws StartupError(kUsage).
RigidTransform transformOf(const std::string& text);

}  // namespace perdure::calibrate
