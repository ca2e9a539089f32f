#include "tools/calibrate/foreign.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/base/errors.h"
#include "common/replay/files/rig_file.h"
#include "common/replay/files/text_file.h"

namespace perdure::calibrate {
namespace {

namespace fs = std::filesystem;
using replay::SensorFile;

std::vector<double> rowsOf(const RigidTransform& transform) {
  const Eigen::Matrix<double, 4, 4, Eigen::RowMajor> rows = transform.matrix();
  return {rows.data(), rows.data() + rows.size()};
}

void put(YAML::Node section, const char* key, const RigidTransform& transform) {
  section[key] = rowsOf(transform);
}

std::vector<double> valuesOf(const SensorFile& file, std::initializer_list<const char*> keys,
                             const std::string& prefix = "") {
  std::vector<double> values;
  for (const char* key : keys) values.push_back(file.number((prefix + key).c_str(), -1e9));
  return values;
}

void setLens(YAML::Node section, const char* camera, const std::vector<double>& intrinsics,
             const char* distortion, const std::vector<double>& coefficients) {
  section["camera_model"] = camera;
  section["intrinsics"] = intrinsics;
  section["distortion_model"] = distortion;
  section["distortion_coeffs"] = coefficients;
}

// VINS-Mono keeps one camera in its configuration; VINS-Fusion names a file for each.

YAML::Node vinsCamera(const SensorFile& file) {
  YAML::Node camera;
  camera["resolution"] = valuesOf(file, {"image_width", "image_height"});
  const std::string model = replay::toLower(file.text("model_type"));
  const auto projection = file.section("projection_parameters");
  if (model == "kannala_brandt") {
    setLens(camera, "pinhole", valuesOf(projection, {"mu", "mv", "u0", "v0"}), "equidistant",
            valuesOf(projection, {"k2", "k3", "k4", "k5"}));
    return camera;
  }
  const auto distortion = valuesOf(file.section("distortion_parameters"), {"k1", "k2", "p1", "p2"});
  if (model == "mei") {
    auto intrinsics = valuesOf(file.section("mirror_parameters"), {"xi"});
    const auto plane = valuesOf(projection, {"gamma1", "gamma2", "u0", "v0"});
    intrinsics.insert(intrinsics.end(), plane.begin(), plane.end());
    setLens(camera, "omni", intrinsics, "radtan", distortion);
  } else if (model == "pinhole") {
    setLens(camera, "pinhole", valuesOf(projection, {"fx", "fy", "cx", "cy"}), "radtan",
            distortion);
  } else {
    file.wrong("model_type", "is `" + model + "`; PINHOLE, KANNALA_BRANDT and MEI are read");
  }
  return camera;
}

std::optional<RigidTransform> vinsPlace(const SensorFile& file) {
  if (!file.has("extrinsicRotation") || !file.has("extrinsicTranslation")) return std::nullopt;
  const auto R = file.numbers("extrinsicRotation", 9), p = file.numbers("extrinsicTranslation", 3);
  YAML::Node rows;
  rows["T"] = std::vector<double>{R[0], R[1], R[2], p[0], R[3], R[4], R[5], p[1],
                                  R[6], R[7], R[8], p[2], 0,    0,    0,    1};
  return SensorFile("extrinsicRotation", rows).transform("T");
}

ForeignRig ofVins(const SensorFile& file, const fs::path& path) {
  ForeignRig rig;
  for (const std::string name : {"cam0", "cam1"}) {
    const bool beside = file.has(name + "_calib");
    if (!beside && (name == "cam1" || !file.has("projection_parameters"))) continue;
    const fs::path camera_file = path.parent_path() / file.text((name + "_calib").c_str());
    YAML::Node camera = vinsCamera(beside ? SensorFile(camera_file) : file);
    if (beside) rig.beside.push_back(camera_file);
    auto place = file.transform(("body_T_" + name).c_str());
    if (!place && name == "cam0") place = vinsPlace(file);
    if (place) put(camera, "T_imu_cam", *place);
    // VINS stamps the first row of an image; here the stamp is that of the middle row.
    const double readout = file.number("rolling_shutter", 0, 0) > 0
                               ? file.number("rolling_shutter_tr", 0.0, 0.0)
                               : 0.0;
    camera["timeshift_cam_imu"] = file.number("td", -1.0, 0.0) + readout / 2;
    camera["readout_s"] = readout;
    rig.sections[name] = camera;
  }
  rig.notes.push_back(
      "no noise of the IMU: acc_n, gyr_n, acc_w and gyr_w of VINS are for one sample, not "
      "densities");
  return rig;
}

// ORB-SLAM3 has flat keys with points; before version 1.0 the first camera's are "Camera.".

YAML::Node orbCamera(const SensorFile& file, const std::string& prefix) {
  YAML::Node camera;
  camera["resolution"] = valuesOf(file, {"Camera.width", "Camera.height"});
  if (file.has("Camera.fps")) camera["rate_hz"] = file.number("Camera.fps", 1e-3);
  const std::string type = replay::toLower(file.text("Camera.type"));
  const auto intrinsics = valuesOf(file, {"fx", "fy", "cx", "cy"}, prefix);
  if (type == "kannalabrandt8") {
    setLens(camera, "pinhole", intrinsics, "equidistant",
            valuesOf(file, {"k1", "k2", "k3", "k4"}, prefix));
  } else if (type == "rectified" || !file.has(prefix + "k1")) {
    setLens(camera, "pinhole", intrinsics, "none", {});
  } else if (type.empty() || type == "pinhole") {
    auto coefficients = valuesOf(file, {"k1", "k2", "p1", "p2"}, prefix);
    if (file.has(prefix + "k3")) coefficients.push_back(file.number((prefix + "k3").c_str(), -1e9));
    setLens(camera, "pinhole", intrinsics, "radtan", coefficients);
  } else {
    file.wrong("Camera.type", "is `" + type + "`; PinHole, KannalaBrandt8 and Rectified are read");
  }
  return camera;
}

/// The second camera's pose in the first camera.
std::optional<RigidTransform> orbSecond(const SensorFile& file) {
  if (const auto place = file.transform("Stereo.T_c1_c2")) return place;
  auto rows = file.list("Tlr");  // 3x4
  if (!rows) return std::nullopt;
  rows->insert(rows->end(), {0, 0, 0, 1});
  rows->resize(16);
  YAML::Node node;
  node["Tlr"] = *rows;
  return SensorFile("Tlr", node).transform("Tlr");
}

ForeignRig ofOrbSlam(const SensorFile& file) {
  if (file.has("LEFT.K")) {
    file.wrong("LEFT.K",
               "says that ORB-SLAM rectifies the images first, so Camera.fx is not that of "
               "the images; give the calibration of the cameras (Kalibr, sensor.yaml)");
  }
  ForeignRig rig;
  rig.sections["cam0"] = orbCamera(file, file.has("Camera1.fx") ? "Camera1." : "Camera.");
  for (const char* key : {"IMU.T_b_c1", "Tbc"}) {
    if (const auto place = file.transform(key)) put(rig.sections["cam0"], "T_imu_cam", *place);
  }
  if (file.has("Camera2.fx")) {
    const auto second = orbSecond(file);
    if (!second) file.wrong("Stereo.T_c1_c2", "is missing, but Camera2 is given");
    rig.sections["cam1"] = orbCamera(file, "Camera2.");
    put(rig.sections["cam1"], "T_cn_cnm1", second->inverse());
  }
  if (file.has("IMU.NoiseGyro")) {
    YAML::Node imu;
    imu["rate_hz"] = file.number("IMU.Frequency", 1e-3);
    imu["gyroscope_noise_density"] = file.number("IMU.NoiseGyro", 0.0);
    imu["accelerometer_noise_density"] = file.number("IMU.NoiseAcc", 0.0);
    imu["gyroscope_random_walk"] = file.number("IMU.GyroWalk", 0.0);
    imu["accelerometer_random_walk"] = file.number("IMU.AccWalk", 0.0);
    rig.sections["imu0"] = imu;
  }
  file.noteUnknownKeys(rig.without_effect, {"File.",
                                            "ORBextractor.",
                                            "Viewer.",
                                            "System.",
                                            "RGBD.",
                                            "LEFT.",
                                            "RIGHT.",
                                            "loopClosing",
                                            "DepthMapFactor",
                                            "ThDepth",
                                            "Stereo.ThDepth",
                                            "Stereo.b",
                                            "Camera.bf",
                                            "Camera.RGB",
                                            "Camera.new",
                                            "Camera.lapping",
                                            "Camera2.lapping",
                                            "Camera1.overlapping",
                                            "Camera2.overlapping",
                                            "IMU.InsertKFsWhenLost",
                                            "IMU.fastInit"});
  return rig;
}

// Basalt's files are JSON, which is valid YAML.

void basaltLens(const SensorFile& intrinsics, YAML::Node camera) {
  const std::string type = intrinsics.text("camera_type");
  const auto lens = intrinsics.section("intrinsics");
  const auto pinhole = valuesOf(lens, {"fx", "fy", "cx", "cy"});
  const auto withFirst = [&](std::initializer_list<const char*> keys) {
    auto values = valuesOf(lens, keys);
    values.insert(values.end(), pinhole.begin(), pinhole.end());
    return values;
  };
  if (type == "ds") return setLens(camera, "ds", withFirst({"xi", "alpha"}), "none", {});
  if (type == "eucm") return setLens(camera, "eucm", withFirst({"alpha", "beta"}), "none", {});
  if (type == "pinhole") return setLens(camera, "pinhole", pinhole, "none", {});
  if (type == "kb4") {
    return setLens(camera, "pinhole", pinhole, "equidistant",
                   valuesOf(lens, {"k1", "k2", "k3", "k4"}));
  }
  if (type == "pinhole-radtan8") {
    return setLens(camera, "pinhole", pinhole, "radtan",
                   valuesOf(lens, {"k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"}));
  }
  intrinsics.wrong("camera_type", "is `" + type +
                                      "`; ds, eucm, kb4, pinhole and pinhole-radtan8 "
                                      "are read");
}

RigidTransform basaltPose(const SensorFile& pose) {
  const auto p = valuesOf(pose, {"px", "py", "pz"}), q = valuesOf(pose, {"qx", "qy", "qz", "qw"});
  const Eigen::Quaterniond rotation(q[3], q[0], q[1], q[2]);
  if (std::abs(rotation.norm() - 1.0) > 1e-2) pose.wrong("qx, qy, qz, qw", "is no unit quaternion");
  return {rotation.normalized(), {p[0], p[1], p[2]}};
}

/// The largest noise of the axes; older files have one number for all axes.
double basaltNoise(const SensorFile& file, const char* key) {
  if (file.has(key) && file.root()[key].IsScalar()) return file.number(key, 0.0);
  const auto values = file.numbers(key, 3);
  return *std::ranges::max_element(values);
}

/// Adds a note about scale and misalignment, which follow the three biases in the list.
void noteScale(const SensorFile& file, const char* key, const std::string& path, ForeignRig& rig) {
  const auto values = file.list(key);
  double most = 0.0;
  for (std::size_t i = 3; values && i < values->size(); ++i) {
    most = std::max(most, std::abs((*values)[i]));
  }
  if (most == 0.0) return;
  rig.without_effect.push_back(fmt::format(
      "{}: {} holds scales and misalignments of up to {:.2g} %, which are not corrected here", path,
      key, 100.0 * most));
}

ForeignRig ofBasalt(const SensorFile& root, const fs::path& path) {
  const SensorFile file = root.section("value0");
  for (const char* key : {"T_imu_cam", "intrinsics", "resolution"}) {
    if (!file.has(key) || !file.root()[key].IsSequence()) file.wrong(key, "is missing or no list");
  }
  const YAML::Node places = file.root()["T_imu_cam"], lenses = file.root()["intrinsics"];
  const YAML::Node sizes = file.root()["resolution"];
  ForeignRig rig;
  for (std::size_t i = 0; i < std::min<std::size_t>(lenses.size(), 2); ++i) {
    const std::string name = fmt::format("cam{}", i);
    if (i >= places.size()) file.wrong("T_imu_cam", "is missing or has too few poses");
    if (i >= sizes.size()) file.wrong("resolution", "is missing or has too few sizes");
    if (!lenses[i].IsMap()) file.wrong("intrinsics", "is no list of objects");
    if (!places[i].IsMap()) file.wrong("T_imu_cam", "is no list of objects");
    YAML::Node camera;
    camera["resolution"] = sizes[i];
    basaltLens(SensorFile(path.string() + ": " + name, lenses[i]), camera);
    put(camera, "T_imu_cam", basaltPose(SensorFile(path.string() + ": T_imu_cam", places[i])));
    camera["timeshift_cam_imu"] = 1e-9 * file.number("cam_time_offset_ns", -1e9, 0.0);
    rig.sections[name] = camera;
  }
  YAML::Node imu;
  imu["rate_hz"] = file.number("imu_update_rate", 1e-3);
  imu["gyroscope_noise_density"] = basaltNoise(file, "gyro_noise_std");
  imu["accelerometer_noise_density"] = basaltNoise(file, "accel_noise_std");
  imu["gyroscope_random_walk"] = basaltNoise(file, "gyro_bias_std");
  imu["accelerometer_random_walk"] = basaltNoise(file, "accel_bias_std");
  rig.sections["imu0"] = imu;
  noteScale(file, "calib_accel_bias", path.string(), rig);
  noteScale(file, "calib_gyro_bias", path.string(), rig);
  return rig;
}

}  // namespace

std::optional<ForeignRig> sectionsOf(const SensorFile& file, const fs::path& path) {
  const std::string maker = replay::makerOf(file);
  if (maker == replay::kVins) return ofVins(file, path);
  if (maker == replay::kOrbSlam) return ofOrbSlam(file);
  if (maker == replay::kBasalt) return ofBasalt(file, path);
  return std::nullopt;
}

}  // namespace perdure::calibrate
