#include "tools/calibrate/import.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>

#include "common/base/errors.h"
#include "common/replay/files/rig_file.h"
#include "common/replay/files/sensor_file.h"
#include "common/replay/files/text_file.h"
#include "tools/calibrate/foreign.h"

namespace perdure::calibrate {
namespace {

namespace fs = std::filesystem;
using replay::SensorFile;

constexpr std::size_t kMostCameras = 2;

class Import {
 public:
  explicit Import(std::vector<RigidTransform> places) : places_(std::move(places)) {}

  void take(const fs::path& path) {
    const auto isIt = [&](const fs::path& other) { return fs::equivalent(path, other); };
    if (std::ranges::any_of(read_, isIt)) return;
    const SensorFile file(path);
    read_.push_back(path);
    if (file.has("cam0") || file.has("imu0")) {
      takeSections(file, path);
    } else if (const auto foreign = sectionsOf(file, path)) {
      append(result_.ignored, foreign->without_effect);
      read_.insert(read_.end(), foreign->beside.begin(), foreign->beside.end());
      takeSections(SensorFile(path.string(), foreign->sections), path);
      append(result_.found, foreign->notes);
    } else if (file.has("gyroscope_noise_density")) {
      takeImu(file, path.string());
    } else if (file.has("intrinsics") || file.has("camera_matrix")) {
      takeCamera(file, path.string());
    } else {
      const std::string maker = replay::makerOf(file);
      throw StartupError(
          ExitCode::kData,
          "{} has none of the keys cam0, imu0, intrinsics, camera_matrix and "
          "gyroscope_noise_density{}; give Kalibr's camchain and imu yaml, ROS' "
          "camera_info, a sensor.yaml, or a calibration of VINS, ORB-SLAM3 or Basalt",
          path.string(), maker.empty() ? "" : ", it is " + maker);
    }
  }

  ImportedRig done() {
    auto& cameras = result_.rig.cameras;
    if (cameras.empty()) {
      throw StartupError(ExitCode::kData,
                         "no file has a camera; give Kalibr's camchain, too: an IMU alone is no "
                         "rig");
    }
    if (given_ != places_.size()) {
      throw StartupError(ExitCode::kUsage,
                         fmt::format("--T_BS was given {} times, and {} of the cameras do not say "
                                     "where they are",
                                     places_.size(), given_));
    }
    for (std::size_t i = 0; i < cameras.size(); ++i) {
      cameras[i].T_BC = (in_body_[i] ? T_I_body_ : T_I_reference_) * cameras[i].T_BC;
    }
    return std::move(result_);
  }

 private:
  static void append(std::vector<std::string>& to, const std::vector<std::string>& more) {
    to.insert(to.end(), more.begin(), more.end());
  }

  void takeSections(const SensorFile& file, const fs::path& path) {
    for (const std::string name : {"cam0", "cam1"}) {
      if (file.has(name)) takeCamera(file.section(name), path.string() + ": " + name);
    }
    if (file.has("imu0")) takeImu(file.section("imu0"), path.string() + ": imu0");
    file.noteUnknownKeys(result_.ignored);
  }

  void takeCamera(const SensorFile& file, const std::string& from) {
    auto& cameras = result_.rig.cameras;
    if (cameras.size() == kMostCameras) {
      throw StartupError(ExitCode::kUsage, from + " is a third camera; two are the most");
    }
    const std::string name = fmt::format("cam{}", cameras.size());
    const bool says = file.has("T_BS") || file.has("T_imu_cam") || file.has("T_cam_imu");
    auto place =
        says || cameras.empty() ? std::nullopt : replay::placeInChain(file, cameras.back());
    if (!says && !place) {
      if (given_ == places_.size()) {
        throw StartupError(
            ExitCode::kData,
            from +
                " does not say where the camera is on the IMU (T_cam_imu, T_imu_cam or T_BS). "
                "Measure it and give --T_BS \"16 numbers\" (camera in the IMU's frame, row by "
                "row), or let perdure calibrate find it from a recording of a board");
      }
      place = places_[given_++];
    }
    cameras.push_back(replay::readCamera(file, name, place));
    in_body_.push_back(!place && file.has("T_BS"));
    result_.found.push_back(fmt::format("{} from {}", name, from));
    noteKeys(file);
  }

  void takeImu(const SensorFile& file, const std::string& from) {
    if (result_.rig.imu) throw StartupError(ExitCode::kUsage, from + " is a second IMU");
    const std::string model = replay::toLower(file.text("model"));
    if (!model.empty() && model != "calibrated") {
      file.wrong("model", "is `" + model +
                              "`: the IMU's own scale and misalignment are not corrected here; "
                              "calibrate with Kalibr's --imu-models calibrated");
    }
    result_.rig.imu = replay::readImuCalibration(file);
    T_I_body_ = file.T_BS().inverse();
    T_I_reference_ = file.transform("T_i_b").value_or(RigidTransform());
    result_.found.push_back("imu0 from " + from);
    noteKeys(file);
  }

  void noteKeys(const SensorFile& file) { file.noteUnknownKeys(result_.ignored); }

  std::vector<RigidTransform> places_;
  std::vector<fs::path> read_;  ///< files that were given, or that another one names
  std::size_t given_ = 0;
  std::vector<bool> in_body_;  ///< one per camera: its file gives the pose in EuRoC's body
  /// Poses in the IMU I, which is our body: EuRoC's body, and the reference of Kalibr's T_cam_imu.
  RigidTransform T_I_body_, T_I_reference_;
  ImportedRig result_;
};

}  // namespace

ImportedRig importRig(const std::vector<fs::path>& files, const std::vector<RigidTransform>& T_BC) {
  Import import(T_BC);
  std::vector<fs::path> ordered = files;
  std::ranges::stable_partition(
      ordered, [](const fs::path& file) { return SensorFile(file).has("cam0_calib"); });
  for (const fs::path& file : ordered) import.take(file);
  return import.done();
}

RigidTransform transformOf(const std::string& text) {
  std::string words = text;
  std::replace_if(
      words.begin(), words.end(), [](char c) { return c == ',' || c == ';'; }, ' ');
  std::istringstream in(words);
  std::vector<double> v;
  for (std::string word; in >> word;) {
    const auto number = replay::parseNumber(word);
    if (!number) throw StartupError(ExitCode::kUsage, "--T_BS: " + word + " is no number");
    v.push_back(*number);
  }
  if (v.size() == 12) v.insert(v.end(), {0, 0, 0, 1});
  using RowMajor = Eigen::Matrix<double, 4, 4, Eigen::RowMajor>;
  const Eigen::Matrix4d m = v.size() == 16 ? Eigen::Matrix4d(Eigen::Map<const RowMajor>(v.data()))
                                           : Eigen::Matrix4d::Zero();
  const Eigen::Matrix3d R = m.topLeftCorner<3, 3>();
  if (!((R * R.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() <= 1e-2) ||
      R.determinant() < 0) {
    throw StartupError(ExitCode::kUsage,
                       "--T_BS is not 16 numbers of a rotation and a translation, row by row");
  }
  return RigidTransform(R, Eigen::Vector3d(m.topRightCorner<3, 1>()));
}

}  // namespace perdure::calibrate
