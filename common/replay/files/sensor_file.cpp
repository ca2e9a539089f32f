#include "common/replay/files/sensor_file.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <cmath>
#include <fstream>

#include "common/base/errors.h"
#include "common/replay/files/text_file.h"

namespace perdure::replay {
namespace {

const char* nameOf(DistortionModel model) {
  switch (model) {
    case DistortionModel::kNone:
      return "none";
    case DistortionModel::kRadialTangential:
      return "radial-tangential";
    case DistortionModel::kEquidistant:
      return "equidistant";
  }
  return "none";
}

}  // namespace

SensorFile::SensorFile(const std::filesystem::path& file) : name_(file.string()) {
  std::ifstream stream(file);
  if (!stream) throwMissing(file, "a sensor's calibration", "EuRoC keeps it beside data.csv");
  std::string text, line;
  while (std::getline(stream, line)) {
    if (line.starts_with('%')) line.clear();  // OpenCV's "%YAML:1.0" is not YAML
    text += line + "\n";
  }
  try {
    root_ = YAML::Load(text);
  } catch (const YAML::Exception& error) {
    throw StartupError(ExitCode::kUnavailable, name_ + ": " + error.what());
  }
  if (!root_.IsMap()) wrong("the file", "holds no `key: value` lines");
}

SensorFile SensorFile::section(const std::string& key) const {
  const YAML::Node node = root_[key];
  if (!node || !node.IsMap()) wrong(key, "is missing or holds no `key: value` lines");
  return {name_ + ": " + key, node};
}

std::vector<double> SensorFile::numbers(const char* key, std::size_t count) const {
  return numbersOf(root_[key], key, count);
}

double SensorFile::number(const char* key, double low) const {
  const YAML::Node node = root_[key];
  const auto value = node && node.IsScalar() ? parseNumber(node.Scalar()) : std::nullopt;
  if (!value || *value < low) wrong(key, "is missing or no number that makes sense");
  return *value;
}

double SensorFile::number(const char* key, double low, double otherwise) const {
  return has(key) ? number(key, low) : otherwise;
}

std::string SensorFile::text(const char* key) const {
  const YAML::Node node = root_[key];
  return node && node.IsScalar() ? node.Scalar() : std::string();
}

RigidTransform SensorFile::T_BS() const {
  if (!has("T_BS")) return {};
  if (!root_["T_BS"].IsMap()) wrong("T_BS", "holds no `data` of 16 numbers");
  using RowMajor = Eigen::Matrix<double, 4, 4, Eigen::RowMajor>;
  const auto v = numbersOf(root_["T_BS"]["data"], "T_BS.data", 16);
  const Eigen::Matrix4d m = Eigen::Map<const RowMajor>(v.data());
  const Eigen::Matrix3d R = m.topLeftCorner<3, 3>();
  const double error = (R * R.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (!(error <= 1e-2) || R.determinant() < 0.0) {
    wrong("T_BS", "is not a rotation and a translation");
  }
  return RigidTransform(R, Eigen::Vector3d(m.topRightCorner<3, 1>()));
}

void SensorFile::wrong(const std::string& key, const std::string& what) const {
  throw StartupError(ExitCode::kUnavailable,
                     name_ + ": " + key + " " + what + "; compare it with a sensor.yaml of EuRoC");
}

std::vector<double> SensorFile::numbersOf(const YAML::Node& node, const std::string& key,
                                          std::size_t count) const {
  std::vector<double> values;
  if (node && node.IsSequence()) {
    for (const auto& item : node) {
      const auto value = item.IsScalar() ? parseNumber(item.Scalar()) : std::nullopt;
      if (value) values.push_back(*value);
    }
  }
  if (values.size() == count) return values;
  wrong(key, "is missing or has not " + std::to_string(count) + " numbers");
}

CameraCalibration readCamera(const SensorFile& file, const std::string& name) {
  CameraCalibration camera;
  camera.name = name;
  const auto size = file.numbers("resolution", 2);
  const auto f = file.numbers("intrinsics", 4);
  if (size[0] < 1 || size[1] < 1 || size[0] > 65535 || size[1] > 65535) {
    file.wrong("resolution", "is no size of an image");
  }
  if (f[0] <= 0 || f[1] <= 0) file.wrong("intrinsics", "have a focal length that is not > 0");
  camera.width = static_cast<std::uint32_t>(size[0]);
  camera.height = static_cast<std::uint32_t>(size[1]);
  camera.fx = f[0], camera.fy = f[1], camera.cx = f[2], camera.cy = f[3];
  camera.rate_hz = file.number("rate_hz", 1e-3);
  const std::string model = toLower(file.text("distortion_model"));
  if (model == "radial-tangential" || model == "radtan") {
    camera.distortion = DistortionModel::kRadialTangential;
  } else if (model == "equidistant") {
    camera.distortion = DistortionModel::kEquidistant;
  } else if (!model.empty() && model != "none") {
    file.wrong("distortion_model",
               "is `" + model + "`; radial-tangential, equidistant and none are known");
  }
  if (camera.distortion != DistortionModel::kNone) {
    camera.distortion_coefficients = file.numbers("distortion_coefficients", 4);
  }
  camera.T_BC = file.T_BS();
  camera.time_offset_s = file.number("time_offset_s", -1.0, 0.0);
  camera.readout_s = file.number("readout_s", 0.0, 0.0);
  return camera;
}

ImuCalibration readImuCalibration(const SensorFile& file) {
  ImuCalibration imu;
  imu.gyro_noise = file.number("gyroscope_noise_density", 0.0);
  imu.gyro_bias_walk = file.number("gyroscope_random_walk", 0.0);
  imu.accel_noise = file.number("accelerometer_noise_density", 0.0);
  imu.accel_bias_walk = file.number("accelerometer_random_walk", 0.0);
  imu.rate_hz = file.number("rate_hz", 1e-3);
  return imu;
}

std::string cameraKeys(const CameraCalibration& camera) {
  std::string text = fmt::format(
      "rate_hz: {}\nresolution: [{}, {}]\ncamera_model: pinhole\nintrinsics: [{}, {}, {}, {}]\n"
      "distortion_model: {}\n",
      camera.rate_hz, camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy,
      nameOf(camera.distortion));
  if (camera.distortion != DistortionModel::kNone) {
    const auto& d = camera.distortion_coefficients;
    text += fmt::format("distortion_coefficients: [{}, {}, {}, {}]\n", d[0], d[1], d[2], d[3]);
  }
  return text + fmt::format(
                    "time_offset_s: {}  # t_imu = t_image + this\n"
                    "readout_s: {}  # first to last row; the stamp is the middle row's\n",
                    camera.time_offset_s, camera.readout_s);
}

std::string imuKeys(const ImuCalibration& imu) {
  return fmt::format(
      "rate_hz: {}\ngyroscope_noise_density: {}\ngyroscope_random_walk: {}\n"
      "accelerometer_noise_density: {}\naccelerometer_random_walk: {}\n",
      imu.rate_hz, imu.gyro_noise, imu.gyro_bias_walk, imu.accel_noise, imu.accel_bias_walk);
}

}  // namespace perdure::replay
