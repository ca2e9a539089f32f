// A sensor's calibration as YAML: EuRoC's sensor.yaml, or a section of a rig file.
#pragma once

#include <yaml-cpp/yaml.h>

#include <filesystem>
#include <string>
#include <vector>

#include "common/types/sensors.h"

namespace perdure::replay {

class SensorFile {
 public:
  /// Throws StartupError(kUnavailable) where the file is missing or no map; so do the others where
  /// a value is missing or makes no sense.
  explicit SensorFile(const std::filesystem::path& file);

  bool has(const std::string& key) const { return static_cast<bool>(root_[key]); }
  /// What stands under `key`, with the name of the file in messages.
  SensorFile section(const std::string& key) const;
  std::vector<double> numbers(const char* key, std::size_t count) const;
  /// At least `low`.
  double number(const char* key, double low) const;
  /// `otherwise` where the key is missing.
  double number(const char* key, double low, double otherwise) const;
  std::string text(const char* key) const;
  /// The sensor in the body; the identity where the file does not say.
  RigidTransform T_BS() const;
  [[noreturn]] void wrong(const std::string& key, const std::string& what) const;

 private:
  SensorFile(std::string name, YAML::Node root) : name_(std::move(name)), root_(std::move(root)) {}
  std::vector<double> numbersOf(const YAML::Node& node, const std::string& key,
                                std::size_t count) const;

  std::string name_;
  YAML::Node root_;
};

/// T_BC is the file's T_BS; time_offset_s and readout_s, which EuRoC does not have, are 0 where
/// they are missing.
CameraCalibration readCamera(const SensorFile& file, const std::string& name);
ImuCalibration readImuCalibration(const SensorFile& file);

/// What the two read, a key a line and all digits, but for T_BS.
std::string cameraKeys(const CameraCalibration& camera);
std::string imuKeys(const ImuCalibration& imu);

}  // namespace perdure::replay
