// The rig file: cameras and IMU of a vehicle. `perdure calibrate` writes it; capture, pipeline and
// calibrate read it. It has sections cam0, cam1 and imu0 with the keys of EuRoC's sensor.yaml. T_BS
// is the pose of the sensor in the body, and the body is the IMU. Kalibr's camchain is a valid rig
// file too.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "common/replay/files/sensor_file.h"
#include "common/types/sensors.h"

namespace perdure::replay {

inline constexpr char kVins[] = "of VINS", kOrbSlam[] = "of ORB-SLAM3", kBasalt[] = "of Basalt",
                      kNotImported[] = "(not imported)";

/// The contents of a rig file, which may have cameras only or the IMU only.
struct RigParts {
  Calibration sensors;
  std::map<std::string, std::string>
      topics;  ///< topics by cam0, cam1 and imu, from Kalibr's `rostopic`
};
/// Throws StartupError with the key and the fix. `notes` receives a sentence for each unknown key.
RigParts readRigParts(const std::filesystem::path& file, std::vector<std::string>* notes = nullptr);
/// Names the origin of a calibration that is not a rig file, such as "of ORB-SLAM3". The text ends
/// with kNotImported if the file cannot be imported, and is empty if its origin is not known.
std::string makerOf(const SensorFile& file);
/// Reads a rig file that must contain cam0.
Calibration readRig(const std::filesystem::path& file, std::vector<std::string>* notes = nullptr);

/// The rig file as text with all digits; `comment` may have several lines.
std::string rigText(const Calibration& rig, const std::string& comment);

/// Replaces the cameras and the IMU of `calibration` by those of the rig; cameras are matched by
/// name. Throws StartupError if the rig lacks one of them or has a different image size.
void applyRig(const Calibration& rig, const std::string& file, Calibration& calibration);

}  // namespace perdure::replay
