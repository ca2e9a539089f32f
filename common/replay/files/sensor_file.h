// A sensor's calibration in YAML: EuRoC's sensor.yaml, a section of a rig file or of Kalibr's
// camchain and imu files, or camera_info of ROS.
#pragma once

#include <yaml-cpp/yaml.h>

#include <filesystem>
#include <initializer_list>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "common/types/sensors.h"

namespace perdure::replay {

class SensorFile {
 public:
  /// Throws StartupError: kUnavailable if the file is missing; kData if it is not a map, or if a
  /// key is repeated. The other functions throw if a value is missing or invalid.
  explicit SensorFile(const std::filesystem::path& file);

  /// Uses a map that was read from a file; messages contain `name`.
  SensorFile(std::string name, YAML::Node root) : name_(std::move(name)), root_(std::move(root)) {
    refuseKeysThatComeTwice();
  }

  bool has(const std::string& key) const { return static_cast<bool>(value(key)); }
  /// The section under `key`; messages contain the name of the file.
  SensorFile section(const std::string& key) const;
  std::vector<double> numbers(const char* key, std::size_t count) const;
  /// Returns the number under `key`. Requires a value of at least `low`.
  double number(const char* key, double low) const;
  /// As above, but returns `otherwise` if the key is missing.
  double number(const char* key, double low, double otherwise) const;
  std::string text(const char* key) const;
  /// Numbers of a list, of a list of rows, or of `data` below the key. Returns nothing if the key
  /// is missing.
  std::optional<std::vector<double>> list(const char* key) const;
  /// A rigid transform as 4×4 numbers, row by row. Returns nothing if the key is missing.
  std::optional<RigidTransform> transform(const char* key) const;
  /// The pose of the sensor in the body; the identity if the file does not contain it.
  RigidTransform T_BS() const { return transform("T_BS").value_or(RigidTransform()); }
  /// The pose of the cameras' reference frame in the IMU: Kalibr's T_i_b, otherwise the inverse of
  /// T_BS.
  RigidTransform T_IB() const;
  const YAML::Node& root() const { return root_; }
  [[noreturn]] void wrong(const std::string& key, const std::string& what) const;
  /// Adds a sentence for each key that was not read and is not known to be irrelevant.
  void noteUnknownKeys(std::vector<std::string>& notes,
                       std::initializer_list<std::string_view> of_no_use = {}) const;

 private:
  void refuseKeysThatComeTwice() const;
  YAML::Node value(const std::string& key) const;

  std::string name_;
  YAML::Node root_;
  mutable std::set<std::string> asked_;
};

/// Reads a camera with keys of EuRoC, Kalibr or ROS:
///
///     resolution | image_width, image_height     intrinsics | camera_matrix
///     distortion_model, distortion_coefficients | distortion_coeffs
///     T_BS | T_imu_cam | T_cam_imu (its inverse)  time_offset_s | timeshift_cam_imu
///
/// One of the three transforms is required, unless `T_BC_given` is set. Models: none;
/// radial-tangential, radtan, plumb_bob (4 coefficients, 5 with k3, 8 rational); equidistant, equi,
/// fisheye, kannala_brandt. Kalibr's omni, eucm and ds are approximated by the nearest equidistant
/// lens (common/camera/wide_lens.h). Time offset, readout and rate are 0 if they are missing.
/// Deviations (deviationKeys) are optional.
CameraCalibration readCamera(const SensorFile& file, const std::string& name,
                             const std::optional<RigidTransform>& T_BC_given = {});
/// Returns T_BC of the second camera in Kalibr's chain from T_cn_cnm1, the transform from the
/// previous camera into this one. Returns nothing if the file does not contain it.
std::optional<RigidTransform> placeInChain(const SensorFile& file, const CameraCalibration& before);
/// Reads the noise and the rate (`rate_hz` or `update_rate`).
ImuCalibration readImuCalibration(const SensorFile& file);

/// YAML text with the keys of readCamera() or readImuCalibration() except T_BS: one key per line,
/// with all digits.
std::string cameraKeys(const CameraCalibration& camera);
/// The lines of the known deviations.
std::string deviationKeys(const CameraDeviations& deviations);
std::string imuKeys(const ImuCalibration& imu);
std::string transformKey(const RigidTransform& T_BS);
/// A complete sensor.yaml. The body frame is the IMU frame.
std::string cameraYaml(const CameraCalibration& camera, const std::string& comment);
std::string imuYaml(const ImuCalibration& imu, const std::string& comment);

}  // namespace perdure::replay
