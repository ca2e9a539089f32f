#include "common/replay/files/rig_file.h"

#include <fmt/format.h>

#include <sstream>

#include "common/base/errors.h"

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

std::string indented(const std::string& text) {
  std::string result, line;
  for (std::istringstream lines(text); std::getline(lines, line);) result += "  " + line + "\n";
  return result;
}

SensorFile opened(const std::filesystem::path& path) {
  if (!std::filesystem::is_regular_file(path)) {
    throw StartupError(ExitCode::kUnavailable,
                       "{} {}; give a rig file, as `perdure calibrate` writes (rig.yaml)",
                       path.c_str(), std::filesystem::exists(path) ? "is no file" : "is missing");
  }
  return SensorFile(path);
}

/// Refuses a file without any section, which would have no effect.
void refuseForeign(const SensorFile& file, const std::string& path) {
  if (file.has("cam0") || file.has("cam1") || file.has("imu0")) return;
  const std::string maker = makerOf(file);
  const bool imported = !maker.empty() && !maker.ends_with(kNotImported);
  throw StartupError(
      ExitCode::kData, "{} is no rig file: it has none of the sections cam0, cam1 and imu0{}; {}",
      path, maker.empty() ? "" : " and is " + maker,
      imported ? "`perdure calibrate import " + path + " --out rig.yaml` makes one of it"
               : "write them with the keys of EuRoC's sensor.yaml, or use `perdure calibrate`. "
                 "`perdure pipeline --rig auto` finds a rig "
                 "from the motion");
}

}  // namespace

std::string makerOf(const SensorFile& file) {
  constexpr std::pair<const char*, const char*> kKeys[] = {
      {"Camera.type", kOrbSlam},
      {"Camera.fx", kOrbSlam},
      {"Camera1.fx", kOrbSlam},
      {"value0", kBasalt},
      {"body_T_cam0", kVins},
      {"cam0_calib", kVins},
      {"extrinsicRotation", kVins},
      {"projection_parameters", kVins},
      {"mirror_parameters", kVins},
      {"cameras", "of Spectacular AI, OKVIS or maplab (not imported)"},
      {"relative_config_imucam", "of OpenVINS, which names the files to give (not imported)"},
      {"target_type", "Kalibr's description of a board (not imported)"},
      {"cameraData", "of DepthAI (OAK) (not imported)"},
      {"ppx", "of librealsense (not imported)"},
      {"gyroscope_noise_density", "an IMU's alone, without its cameras"},
      {"intrinsics", "one camera's"},
      {"camera_matrix", "ROS' camera_info"}};
  for (const auto& [key, maker] : kKeys) {
    if (file.has(key)) return maker;
  }
  return {};
}

RigParts readRigParts(const std::filesystem::path& path, std::vector<std::string>* notes) {
  const SensorFile file = opened(path);
  refuseForeign(file, path.string());
  RigParts parts;
  Calibration& rig = parts.sensors;
  const auto takeTopic = [&](const SensorFile& section, const std::string& role) {
    if (section.has("rostopic")) parts.topics[role] = section.text("rostopic");
  };
  for (const std::string name : {"cam0", "cam1"}) {
    if (!file.has(name)) continue;
    const SensorFile section = file.section(name);
    const auto in_chain =
        rig.cameras.empty() ? std::nullopt : placeInChain(section, rig.cameras.back());
    rig.cameras.push_back(readCamera(section, name, in_chain));
    takeTopic(section, name);
    if (notes) section.noteUnknownKeys(*notes);
  }
  if (file.has("imu0")) {
    const SensorFile imu = file.section("imu0");
    rig.imu = readImuCalibration(imu);
    takeTopic(imu, "imu");
    for (auto& camera : rig.cameras) camera.T_BC = imu.T_IB() * camera.T_BC;
    if (notes) imu.noteUnknownKeys(*notes);
  }
  return parts;
}

Calibration readRig(const std::filesystem::path& path, std::vector<std::string>* notes) {
  const SensorFile file = opened(path);
  refuseForeign(file, path.string());
  if (!file.has("cam0")) file.wrong("cam0", "is missing");
  return readRigParts(path, notes).sensors;
}

std::string rigText(const Calibration& rig, const std::string& comment) {
  std::string text, line;
  for (std::istringstream lines(comment); std::getline(lines, line);) text += "# " + line + "\n";
  for (const auto& camera : rig.cameras) {
    text += camera.name + ":\n" + transformText(camera.T_BC) + indented(cameraKeys(camera));
  }
  return rig.imu ? text + "imu0:\n" + indented(imuKeys(*rig.imu)) : text;
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
    const double rate_hz = given->rate_hz > 0.0 ? given->rate_hz : camera.rate_hz;
    camera = *given;
    camera.rate_hz = rate_hz;
  }
  if (rig.imu) calibration.imu = rig.imu;
}

}  // namespace perdure::replay
