// Reads cameras and inertial units from the keys of EuRoC, Kalibr and ROS.
#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "common/camera/lens.h"
#include "common/camera/wide_lens.h"
#include "common/replay/files/sensor_file.h"
#include "common/replay/files/text_file.h"

namespace perdure::replay {
namespace {

bool isOneOf(const std::string& name, std::initializer_list<const char*> names) {
  return std::any_of(names.begin(), names.end(), [&](const char* one) { return name == one; });
}

void readSize(const SensorFile& file, CameraCalibration& camera) {
  std::vector<double> size;
  if (!file.has("resolution") && file.has("image_width")) {
    size = {file.number("image_width", 1), file.number("image_height", 1)};
  } else {
    size = file.numbers("resolution", 2);
  }
  if (size[0] < 1 || size[1] < 1 || size[0] > 65535 || size[1] > 65535) {
    file.wrong("resolution", "is no size of an image");
  }
  camera.width = static_cast<std::uint32_t>(size[0]);
  camera.height = static_cast<std::uint32_t>(size[1]);
}

void readFocalLengths(const SensorFile& file, CameraCalibration& camera) {
  std::vector<double> f;
  if (!file.has("intrinsics") && file.has("camera_matrix")) {
    const auto K = file.numbers("camera_matrix", 9);
    f = {K[0], K[4], K[2], K[5]};
  } else {
    f = file.numbers("intrinsics", 4);
  }
  if (f[0] <= 0 || f[1] <= 0) file.wrong("intrinsics", "have a focal length that is not > 0");
  camera.fx = f[0], camera.fy = f[1], camera.cx = f[2], camera.cy = f[3];
}

/// Returns the distortion model, which Kalibr may write as a part of the lens: "pinhole-radtan".
std::string distortionName(const SensorFile& file) {
  const std::string lens = toLower(file.text("camera_model"));
  const auto dash = lens.find('-');
  if (!isOneOf(lens.substr(0, dash), {"", "pinhole", "perspective", "kannala_brandt"})) {
    file.wrong("camera_model",
               "is `" + lens +
                   "`; pinhole lenses are read, with radtan or equidistant distortion, and omni, "
                   "eucm and ds: calibrate as pinhole-radtan, pinhole-equi or ds-none");
  }
  const std::string model = toLower(file.text("distortion_model"));
  if (model.empty() && lens == "kannala_brandt") return "equidistant";
  return model.empty() && dash != lens.npos ? lens.substr(dash + 1) : model;
}

std::vector<double> coefficientsOf(const SensorFile& file) {
  for (const char* key : {"distortion_coefficients", "distortion_coeffs"}) {
    if (const auto values = file.list(key)) return *values;
  }
  return {};
}

/// Reads Kalibr's unified, extended unified or double sphere lens. Returns nothing for other
/// lenses.
std::optional<WideLens> wideLensOf(const SensorFile& file) {
  const std::string lens = toLower(file.text("camera_model"));
  const std::string model = lens.substr(0, lens.find('-'));
  WideLens wide;
  std::vector<double> v;
  if (model == "omni" || model == "mei" || model == "unified") {
    v = file.numbers("intrinsics", 5);  // xi, focal lengths, principal point
    v.insert(v.begin() + 1, 0.0);
  } else if (model == "eucm" || model == "ds" || model == "double_sphere") {
    wide.kind = model == "eucm" ? WideLens::Kind::kExtendedUnified : WideLens::Kind::kDoubleSphere;
    v = file.numbers("intrinsics", 6);  // xi and alpha, or alpha and beta, before the same four
  } else {
    return std::nullopt;
  }
  wide.a = v[0], wide.b = v[1], wide.fx = v[2], wide.fy = v[3], wide.cx = v[4], wide.cy = v[5];
  const bool alpha = wide.kind == WideLens::Kind::kUnified ||
                     (wide.kind == WideLens::Kind::kExtendedUnified ? wide.a : wide.b) >= 0.0;
  if (!(wide.fx > 0 && wide.fy > 0) || !alpha) {
    file.wrong("intrinsics", "are of no lens that can be");
  }
  return wide;
}

void readWideLens(const SensorFile& file, WideLens wide, CameraCalibration& camera) {
  const std::string model = toLower(file.text("distortion_model"));
  const auto values = coefficientsOf(file);
  const bool any = std::any_of(values.begin(), values.end(), [](double d) { return d != 0.0; });
  const bool radial = isOneOf(model, {"radtan", "radial-tangential", "plumb_bob"});
  if (any && (!radial || wide.kind != WideLens::Kind::kUnified || values.size() != 4)) {
    file.wrong("distortion_model", "is `" + model +
                                       "` on a wide lens; calibrate as ds-none, omni-radtan or "
                                       "pinhole-equi");
  }
  if (any) std::copy_n(values.begin(), 4, wide.distortion.begin());
  const auto fit = fitEquidistant(wide, camera);
  if (!fit) file.wrong(fit.error().code, fit.error().detail);
}

void readLens(const SensorFile& file, CameraCalibration& camera) {
  if (const auto wide = wideLensOf(file)) return readWideLens(file, *wide, camera);
  const std::string name = distortionName(file);
  readFocalLengths(file, camera);
  const auto set = setLens(camera, name, coefficientsOf(file));
  if (!set) file.wrong(set.error().code, set.error().detail);
}

/// Readout time from the first row to the last, s. Kalibr and TUM's rolling shutter data give it
/// per row.
double readoutOf(const SensorFile& file, std::uint32_t rows) {
  for (const auto& [key, unit_s] : {std::pair("line_delay", 1.0), std::pair("line-delay", 1.0),
                                    std::pair("line_delay_nanoseconds", 1e-9)}) {
    if (file.has(key)) return unit_s * file.number(key, 0.0) * rows;
  }
  return file.number("readout_s", 0.0, 0.0);
}

RigidTransform placeOf(const SensorFile& file, const std::optional<RigidTransform>& given) {
  if (const auto T_BS = file.transform("T_BS")) return *T_BS;
  if (const auto T_BC = file.transform("T_imu_cam")) return *T_BC;
  if (const auto T_CB = file.transform("T_cam_imu")) return T_CB->inverse();
  if (given) return *given;
  file.wrong(
      "T_BS",
      "is missing, and so are T_cam_imu and T_imu_cam: where is the camera on the IMU? Write "
      "T_BS (camera in the IMU's frame, 4x4, row by row), or let perdure calibrate find it");
}

struct DeviationKey {
  const char* key;
  double CameraDeviations::*value;
  double most;
};
constexpr DeviationKey kDeviations[] = {
    {"focal_sigma", &CameraDeviations::focal, 0.3},
    {"centre_sigma_px", &CameraDeviations::centre_px, 1000.0},
    {"distortion_sigma", &CameraDeviations::distortion, 1.0},
    {"rotation_sigma", &CameraDeviations::rotation, 0.5},
    {"position_sigma_m", &CameraDeviations::position_m, 10.0},
    {"time_offset_sigma_s", &CameraDeviations::time_offset_s, 0.2}};

CameraDeviations deviationsOf(const SensorFile& file) {
  CameraDeviations deviations;
  for (const DeviationKey& one : kDeviations) {
    if (!file.has(one.key)) continue;
    const double value = file.number(one.key, 1e-12);
    if (value > one.most) file.wrong(one.key, fmt::format("is more than {}", one.most));
    deviations.*one.value = value;
  }
  return deviations;
}

}  // namespace

std::string deviationKeys(const CameraDeviations& deviations) {
  std::string text;
  for (const DeviationKey& one : kDeviations) {
    const double value = deviations.*one.value;
    if (value > 0.0) text += fmt::format("{}: {}\n", one.key, value);
  }
  return text;
}

CameraCalibration readCamera(const SensorFile& file, const std::string& name,
                             const std::optional<RigidTransform>& T_BC_given) {
  CameraCalibration camera;
  camera.name = name;
  readSize(file, camera);
  readLens(file, camera);
  camera.T_BC = placeOf(file, T_BC_given);
  camera.rate_hz = file.number("rate_hz", 1e-3, 0.0);
  camera.time_offset_s = file.has("time_offset_s") ? file.number("time_offset_s", -1.0)
                                                   : file.number("timeshift_cam_imu", -1.0, 0.0);
  camera.readout_s = readoutOf(file, camera.height);
  camera.deviations = deviationsOf(file);
  return camera;
}

std::optional<RigidTransform> placeInChain(const SensorFile& file,
                                           const CameraCalibration& before) {
  const auto T_C_before = file.transform("T_cn_cnm1");
  if (!T_C_before) return std::nullopt;
  return before.T_BC * T_C_before->inverse();
}

ImuCalibration readImuCalibration(const SensorFile& file) {
  ImuCalibration imu;
  imu.gyro_noise = file.number("gyroscope_noise_density", 0.0);
  imu.gyro_bias_walk = file.number("gyroscope_random_walk", 0.0);
  imu.accel_noise = file.number("accelerometer_noise_density", 0.0);
  imu.accel_bias_walk = file.number("accelerometer_random_walk", 0.0);
  const bool of_kalibr = !file.has("rate_hz") && file.has("update_rate");
  imu.rate_hz = file.number(of_kalibr ? "update_rate" : "rate_hz", 1e-3);
  return imu;
}

}  // namespace perdure::replay
