// The rig file: cameras and IMU of a vehicle, as `perdure calibrate` writes them and as capture,
// pipeline and calibrate read them. Sections cam0, cam1 and imu0 with the keys of EuRoC's
// sensor.yaml; T_BS is the sensor in the body, and the body is the IMU. Kalibr's camchain is one,
// too.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "common/types/sensors.h"

namespace perdure::replay {

/// What a rig file has, which may be cameras alone or the IMU alone.
struct RigParts {
  Calibration sensors;
  std::map<std::string, std::string> topics;  ///< of ROS, by cam0, cam1, imu: Kalibr's `rostopic`
};
/// Throws StartupError with the key and the mend. `notes` gets a sentence for each unknown key.
RigParts readRigParts(const std::filesystem::path& file, std::vector<std::string>* notes = nullptr);
/// The same of a file that must have cam0.
Calibration readRig(const std::filesystem::path& file, std::vector<std::string>* notes = nullptr);

/// All digits; `comment` may have several lines.
std::string rigText(const Calibration& rig, const std::string& comment);

/// Puts the rig's cameras and IMU in place of those of `calibration`, camera by camera of the same
/// name. Throws StartupError where one is missing in the rig or has another size of image.
void applyRig(const Calibration& rig, const std::string& file, Calibration& calibration);

}  // namespace perdure::replay
