// Converts calibrations of VINS, ORB-SLAM3 and Basalt to sections of a rig file.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "common/replay/files/sensor_file.h"

namespace perdure::calibrate {

struct ForeignRig {
  YAML::Node sections;             ///< cam0, cam1 and imu0 with the keys of Kalibr
  std::vector<std::string> notes;  ///< for people
  std::vector<std::string> without_effect;
  std::vector<std::filesystem::path> beside;  ///< other files that were read
};

/// Converts the file; returns nothing if it belongs to another program. A camera has no transform
/// if the file does not contain its pose. Throws StartupError with the key and the fix.
std::optional<ForeignRig> sectionsOf(const replay::SensorFile& file,
                                     const std::filesystem::path& path);

}  // namespace perdure::calibrate
