#include "common/replay/files/rig_file.h"

#include <fmt/format.h>

#include <sstream>

#include "common/base/errors.h"
#include "common/replay/files/sensor_file.h"

namespace perdure::replay {
namespace {

std::string transformText(const RigidTransform& T_BS) {
  const Eigen::Matrix4d m = T_BS.matrix();
  std::string rows;
  for (int row = 0; row < 4; ++row) {
    rows += fmt::format("{}{}, {}, {}, {}", row == 0 ? "" : ",\n           ", m(row, 0), m(row, 1),
                        m(row, 2), m(row, 3));
  }
  return fmt::format("  T_BS:\n    cols: 4\n    rows: 4\n    data: [{}]\n", rows);
}

std::string cameraText(const CameraCalibration& camera) {
  std::string text = fmt::format("{}:\n", camera.name) + transformText(camera.T_BC);
  text += fmt::format("  rate_hz: {}\n  resolution: [{}, {}]\n  camera_model: pinhole\n",
                      camera.rate_hz, camera.width, camera.height);
  text +=
      fmt::format("  intrinsics: [{}, {}, {}, {}]\n", camera.fx, camera.fy, camera.cx, camera.cy);
  const auto& d = camera.distortion_coefficients;
  if (camera.distortion == DistortionModel::kNone) {
    text += "  distortion_model: none\n";
  } else {
    const bool equidistant = camera.distortion == DistortionModel::kEquidistant;
    text += fmt::format("  distortion_model: {}\n  distortion_coefficients: [{}, {}, {}, {}]\n",
                        equidistant ? "equidistant" : "radial-tangential", d[0], d[1], d[2], d[3]);
  }
  return text + fmt::format(
                    "  time_offset_s: {}  # t_imu = t_image + this\n"
                    "  readout_s: {}  # first to last row; the stamp is the middle row's\n",
                    camera.time_offset_s, camera.readout_s);
}

std::string imuText(const ImuCalibration& imu) {
  return fmt::format(
      "imu0:\n  rate_hz: {}\n  gyroscope_noise_density: {}\n  gyroscope_random_walk: {}\n"
      "  accelerometer_noise_density: {}\n  accelerometer_random_walk: {}\n",
      imu.rate_hz, imu.gyro_noise, imu.gyro_bias_walk, imu.accel_noise, imu.accel_bias_walk);
}

}  // namespace

Calibration readRig(const std::filesystem::path& path) {
  if (!std::filesystem::is_regular_file(path)) {
    throw StartupError(
        ExitCode::kUnavailable,
        path.string() + " is no rig file; `perdure calibrate` writes one (rig.yaml)");
  }
  const SensorFile file(path);
  Calibration rig;
  for (const std::string name : {"cam0", "cam1"}) {
    if (file.has(name)) rig.cameras.push_back(readCamera(file.section(name), name));
  }
  if (rig.cameras.empty() || rig.cameras[0].name != "cam0") file.wrong("cam0", "is missing");
  if (file.has("imu0")) {
    const SensorFile imu = file.section("imu0");
    rig.imu = readImuCalibration(imu);
    for (auto& camera : rig.cameras) camera.T_BC = imu.T_BS().inverse() * camera.T_BC;
  }
  return rig;
}

std::string rigText(const Calibration& rig, const std::string& comment) {
  std::string text, line;
  for (std::istringstream lines(comment); std::getline(lines, line);) text += "# " + line + "\n";
  for (const auto& camera : rig.cameras) text += cameraText(camera);
  return rig.imu ? text + imuText(*rig.imu) : text;
}

void applyRig(const Calibration& rig, const std::string& file, Calibration& calibration) {
  const auto stop = [&](const std::string& what) {
    throw StartupError(ExitCode::kConfiguration, file + ": " + what);
  };
  for (auto& camera : calibration.cameras) {
    const CameraCalibration* given = rig.camera(camera.name);
    if (!given) stop("has no section " + camera.name + ", which the drive has; calibrate it too");
    if (given->width != camera.width || given->height != camera.height) {
      stop(fmt::format("{} is for images of {}x{}, the drive's are {}x{}; calibrate at that size",
                       camera.name, given->width, given->height, camera.width, camera.height));
    }
    camera = *given;
  }
  if (rig.imu) calibration.imu = rig.imu;
}

}  // namespace perdure::replay
