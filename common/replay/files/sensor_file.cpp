#include "common/replay/files/sensor_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <sstream>

#include "common/base/errors.h"
#include "common/math/so3.h"
#include "common/replay/files/text_file.h"

namespace perdure::replay {
namespace {

const char* nameOf(DistortionModel model) {
  if (model == DistortionModel::kNone) return "none";
  return model == DistortionModel::kEquidistant ? "equidistant" : "radial-tangential";
}

/// Refuses files that other programs write and that are not YAML. `line` is the first line.
void refuseOtherFormats(const std::string& name, std::string_view line) {
  const auto isBinary = [](char c) { return c >= 0 && c < ' ' && c != '\t' && c != '\r'; };
  const bool wide = line.starts_with("\xFF\xFE") || line.starts_with("\xFE\xFF");  // UTF-16
  const char* what =
      line.starts_with("Calibration results") || line.starts_with("Camera-system parameters")
          ? "Kalibr's report for readers; give the camchain-imucam yaml that Kalibr writes beside "
            "it"
      : line.starts_with("# Camera list with one line of data per camera")
          ? "COLMAP's cameras.txt, which has no pose on the body; write a yaml with the section "
            "cam0: camera_model: pinhole, intrinsics: [fx, fy, cx, cy], distortion_model: "
            "radial-tangential, distortion_coefficients: [k1, k2, p1, p2] (its model OPENCV), "
            "resolution and T_BS, or use `perdure calibrate`"
      : line.starts_with("\xFF\xD8") ? "a JPEG image; give the yaml of the calibration"
      : line.starts_with("\x89PNG")  ? "a PNG image; give the yaml of the calibration"
      : !wide && std::ranges::any_of(line, isBinary) ? "no text; give the yaml of the calibration"
                                                     : nullptr;
  if (what) throw StartupError(ExitCode::kData, "{} is {}", name, what);
}

/// Returns the error of the YAML reader with its place, and the cause if it is a tab.
std::string faultOf(const YAML::Exception& error, const std::string& name,
                    const std::string& text) {
  std::istringstream lines(text);
  std::string line;
  for (int number = 1; std::getline(lines, line); ++number) {
    const auto indent = line.substr(0, line.find_first_not_of(" \t"));
    const bool near = std::abs(number - 1 - error.mark.line) <= 1;
    if (!near || indent.find('\t') == std::string::npos) continue;
    return fmt::format("{}:{}: the line is indented with a tab, which YAML forbids; write blanks",
                       name, number);
  }
  return fmt::format("{}:{}:{}: {}; it must be YAML: `key: value` lines, sections indented", name,
                     error.mark.line + 1, error.mark.column + 1, error.msg);
}

}  // namespace

SensorFile::SensorFile(const std::filesystem::path& file) : name_(file.string()) {
  std::ifstream stream(file);
  if (!stream) throwMissing(file, "a sensor's calibration", "EuRoC keeps it beside data.csv");
  std::string text, line;
  while (std::getline(stream, line)) {
    if (text.empty()) refuseOtherFormats(name_, line);
    if (line.starts_with('%')) line.clear();  // OpenCV's "%YAML:1.0" is not valid YAML
    text += line + "\n";
  }
  try {
    root_ = YAML::Load(text);
  } catch (const YAML::Exception& error) {
    throw StartupError(ExitCode::kData, faultOf(error, name_, text));
  }
  if (!root_.IsMap()) wrong("the file", "holds no `key: value` lines");
  refuseKeysThatComeTwice();
}

/// Refuses repeated keys, because other parsers use either the first or the last.
void SensorFile::refuseKeysThatComeTwice() const {
  std::set<std::string> keys;
  for (const auto& entry : root_) {
    if (!entry.first.IsScalar() || keys.insert(entry.first.Scalar()).second) continue;
    throw StartupError(ExitCode::kData, fmt::format("{}: the key `{}` is there twice; keep one",
                                                    name_, entry.first.Scalar()));
  }
}

SensorFile SensorFile::section(const std::string& key) const {
  const YAML::Node node = root_[key];
  if (!node || !node.IsMap()) wrong(key, "is missing or holds no `key: value` lines");
  return {name_ + ": " + key, node};
}

YAML::Node SensorFile::value(const std::string& key) const {
  asked_.insert(key);
  return root_[key];
}

std::optional<std::vector<double>> SensorFile::list(const char* key) const {
  YAML::Node node = value(key);
  if (!node) return std::nullopt;
  if (node.IsMap()) {
    if (!node["data"]) wrong(key, "holds no `data`");
    node.reset(node["data"]);
  }
  std::vector<double> values;
  const auto take = [&](const YAML::Node& item) {
    const auto number = item.IsScalar() ? parseNumber(item.Scalar()) : std::nullopt;
    if (!number) wrong(key, "holds something that is no number");
    values.push_back(*number);
  };
  if (!node.IsSequence()) wrong(key, "holds no `data` or list of numbers");
  for (const auto& item : node) {
    if (!item.IsSequence()) {
      take(item);
      continue;
    }
    for (const auto& number : item) take(number);
  }
  return values;
}

std::vector<double> SensorFile::numbers(const char* key, std::size_t count) const {
  auto values = list(key);
  if (values && values->size() == count) return *std::move(values);
  wrong(key, "is missing or has not " + std::to_string(count) + " numbers");
}

double SensorFile::number(const char* key, double low) const {
  const YAML::Node node = value(key);
  const auto number = node && node.IsScalar() ? parseNumber(node.Scalar()) : std::nullopt;
  if (!number || *number < low) wrong(key, "is missing or no number that makes sense");
  return *number;
}

double SensorFile::number(const char* key, double low, double otherwise) const {
  return has(key) ? number(key, low) : otherwise;
}

std::string SensorFile::text(const char* key) const {
  const YAML::Node node = value(key);
  return node && node.IsScalar() ? node.Scalar() : std::string();
}

std::optional<RigidTransform> SensorFile::transform(const char* key) const {
  if (!has(key)) return std::nullopt;
  using RowMajor = Eigen::Matrix<double, 4, 4, Eigen::RowMajor>;
  const auto v = numbers(key, 16);
  const Eigen::Matrix4d m = Eigen::Map<const RowMajor>(v.data());
  const Eigen::Matrix3d R = m.topLeftCorner<3, 3>();
  if (!isRotation(R)) wrong(key, "is not a rotation and a translation");
  return RigidTransform(R, Eigen::Vector3d(m.topRightCorner<3, 1>()));
}

RigidTransform SensorFile::T_IB() const {
  const auto T_ib = transform("T_i_b");
  return T_ib ? *T_ib : T_BS().inverse();
}

void SensorFile::wrong(const std::string& key, const std::string& what) const {
  const YAML::Node node = root_.IsMap() ? root_[key] : YAML::Node();
  const int line = node ? node.Mark().line + 1 : 0;
  throw StartupError(ExitCode::kData, "{}: {} {}{}; compare it with a sensor.yaml of EuRoC", name_,
                     key, what, line > 0 ? fmt::format(" (line {})", line) : "");
}

void SensorFile::noteUnknownKeys(std::vector<std::string>& notes,
                                 std::initializer_list<std::string_view> of_no_use) const {
  // Known keys of EuRoC, Kalibr and ROS that have no effect here.
  static const std::set<std::string> kOfNoUse{"sensor_type",
                                              "comment",
                                              "rostopic",
                                              "cam_overlaps",
                                              "T_cn_cnm1",
                                              "camera_name",
                                              "camera_id",
                                              "projection_matrix",
                                              "gyroscope_misalignment",
                                              "model",
                                              "T_BS",
                                              "rectification_matrix",
                                              "time_offset",
                                              "camera_model",
                                              "cam0",
                                              "cam1",
                                              "imu0"};
  for (const auto& entry : root_) {
    const std::string key = entry.first.IsScalar() ? entry.first.Scalar() : std::string();
    if (key.empty() || asked_.contains(key) || kOfNoUse.contains(key)) continue;
    const auto beginsKey = [&](std::string_view prefix) { return key.starts_with(prefix); };
    if (std::any_of(of_no_use.begin(), of_no_use.end(), beginsKey)) continue;
    notes.push_back(name_ + ": the key `" + key + "` is not known and has no effect");
  }
}

std::string cameraKeys(const CameraCalibration& camera) {
  std::string text = camera.rate_hz > 0.0 ? fmt::format("rate_hz: {}\n", camera.rate_hz) : "";
  text += fmt::format(
      "resolution: [{}, {}]\ncamera_model: pinhole\nintrinsics: [{}, {}, {}, {}]\n"
      "distortion_model: {}\n",
      camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy,
      nameOf(camera.distortion));
  if (camera.distortion != DistortionModel::kNone) {
    text += fmt::format("distortion_coefficients: [{}]\n",
                        fmt::join(camera.distortion_coefficients, ", "));
  }
  return text +
         fmt::format(
             "time_offset_s: {}  # t_imu = t_image + this\n"
             "readout_s: {}  # first to last row; the stamp is the middle row's\n",
             camera.time_offset_s, camera.readout_s) +
         deviationKeys(camera.deviations);
}

std::string imuKeys(const ImuCalibration& imu) {
  return fmt::format(
      "rate_hz: {}\ngyroscope_noise_density: {}\ngyroscope_random_walk: {}\n"
      "accelerometer_noise_density: {}\naccelerometer_random_walk: {}\n",
      imu.rate_hz, imu.gyro_noise, imu.gyro_bias_walk, imu.accel_noise, imu.accel_bias_walk);
}

std::string transformKey(const RigidTransform& T_BS) {
  const Eigen::Matrix4d m = T_BS.matrix();
  std::string numbers;
  for (int row = 0; row < 4; ++row) {
    for (int column = 0; column < 4; ++column) {
      numbers += fmt::format("{}{}", numbers.empty() ? "" : ", ", m(row, column));
    }
  }
  return fmt::format("T_BS:\n  cols: 4\n  rows: 4\n  data: [{}]\n", numbers);
}

std::string cameraYaml(const CameraCalibration& camera, const std::string& comment) {
  return fmt::format("sensor_type: camera\ncomment: {}\n\n", comment) + transformKey(camera.T_BC) +
         "\n" + cameraKeys(camera);
}

std::string imuYaml(const ImuCalibration& imu, const std::string& comment) {
  return fmt::format("sensor_type: imu\ncomment: {}\n\n", comment) + transformKey({}) + "\n" +
         imuKeys(imu);
}

}  // namespace perdure::replay
