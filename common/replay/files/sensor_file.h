// A sensor's calibration as YAML: EuRoC's sensor.yaml, a section of a rig file or of Kalibr's
// camchain and imu files, or ROS' camera_info.
#pragma once

#include <yaml-cpp/yaml.h>

#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "common/types/sensors.h"

namespace perdure::replay {

class SensorFile {
 public:
  /// Throws StartupError: kUnavailable where the file is missing; kData where it is no map, or a
  /// key is there twice. So do the others where a value is missing or makes no sense.
  explicit SensorFile(const std::filesystem::path& file);

  bool has(const std::string& key) const { return static_cast<bool>(value(key)); }
  /// What stands under `key`, with the name of the file in messages.
  SensorFile section(const std::string& key) const;
  std::vector<double> numbers(const char* key, std::size_t count) const;
  /// At least `low`.
  double number(const char* key, double low) const;
  /// `otherwise` where the key is missing.
  double number(const char* key, double low, double otherwise) const;
  std::string text(const char* key) const;
  /// Numbers of a list, of a list of rows, or of the `data` below the key; nothing where the key is
  /// missing.
  std::optional<std::vector<double>> list(const char* key) const;
  /// A rigid transform as 4×4 numbers, row by row; nothing where the key is missing.
  std::optional<RigidTransform> transform(const char* key) const;
  /// The sensor in the body; the identity where the file does not say.
  RigidTransform T_BS() const { return transform("T_BS").value_or(RigidTransform()); }
  [[noreturn]] void wrong(const std::string& key, const std::string& what) const;
  /// A sentence for each key that nobody asked for and that is not known to be of no use here.
  std::vector<std::string> unknownKeys() const;

 private:
  SensorFile(std::string name, YAML::Node root) : name_(std::move(name)), root_(std::move(root)) {
    refuseKeysThatComeTwice();
  }
  void refuseKeysThatComeTwice() const;
  YAML::Node value(const std::string& key) const;

  std::string name_;
  YAML::Node root_;
  mutable std::set<std::string> asked_;
};

/// Keys of EuRoC, Kalibr or ROS:
///
///     resolution | image_width, image_height     intrinsics | camera_matrix
///     distortion_model, distortion_coefficients | distortion_coeffs
///     T_BS | T_imu_cam | T_cam_imu (its inverse)  time_offset_s | timeshift_cam_imu
///
/// One of the three transforms must be there. Where `T_BC_given` is given it may be missing.
/// Models: none; radial-tangential, radtan, plumb_bob (4 coefficients, 5 with k3, 8 rational);
/// equidistant, equi, fisheye, kannala_brandt; Kalibr's omni, eucm and ds become the equidistant
/// lens that is nearest to them (common/camera/wide_lens.h). Time offset, readout and rate are 0
/// where they are missing.
CameraCalibration readCamera(const SensorFile& file, const std::string& name,
                             const std::optional<RigidTransform>& T_BC_given = {});
/// Of two cameras of Kalibr's chain: where T_cam_imu is missing, T_cn_cnm1 (this camera from the
/// one before) gives T_BC.
std::optional<RigidTransform> placeInChain(const SensorFile& file, const CameraCalibration& before);
/// The rate is `rate_hz` or `update_rate`.
ImuCalibration readImuCalibration(const SensorFile& file);

/// What the two read, a key a line and all digits, but for T_BS.
std::string cameraKeys(const CameraCalibration& camera);
std::string imuKeys(const ImuCalibration& imu);
std::string transformKey(const RigidTransform& T_BS);
/// A whole sensor.yaml. The IMU is the body.
std::string cameraYaml(const CameraCalibration& camera, const std::string& comment);
std::string imuYaml(const ImuCalibration& imu, const std::string& comment);

}  // namespace perdure::replay
