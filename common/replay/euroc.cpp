// EuRoC ASL folders: mav0/{cam0,cam1,imu0,state_groundtruth_estimate0}, CSVs and sensor.yaml. An
// optional speed0 (`#timestamp [ns],speed [m s^-1]`) exists for simulated vehicles. The body is the
// IMU: if T_BS of imu0 is not the identity, all data are transformed to the IMU.
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <optional>

#include "common/base/algorithms/folder.h"
#include "common/base/errors.h"
#include "common/replay/files/image_folder.h"
#include "common/replay/files/rig_file.h"
#include "common/replay/files/sensor_file.h"
#include "common/replay/files/text_file.h"
#include "common/replay/recording.h"
#include "common/replay/sensor_table.h"

namespace perdure::replay {
namespace {

namespace fs = std::filesystem;

constexpr char kImuColumns[] =
    "seven columns are awaited: timestamp [ns], w_x, w_y, w_z [rad/s], a_x, a_y, a_z [m/s^2]";

using Fields = std::vector<std::string_view>;

/// Returns whether commas separate the columns and the decimals: six numbers are two fields each.
bool hasDecimalCommas(const Fields& fields) {
  if (fields.size() != 13) return false;
  for (std::size_t i = 2; i < fields.size(); i += 2) {
    const auto decimals = trim(fields[i]);
    if (decimals.find_first_not_of("0123456789eE+-") != decimals.npos) return false;
    if (decimals.empty() || decimals[0] < '0' || decimals[0] > '9') return false;
  }
  return true;
}

std::string judgeImu(const Fields& fields) {
  if (hasDecimalCommas(fields)) {
    return std::string(
               "13 columns: the numbers have decimal commas; export the table with decimal "
               "points; ") +
           kImuColumns;
  }
  if (fields.size() != 7)
    return std::to_string(fields.size()) + " columns; " + kImuColumns +
           (fields.size() > 7 ? "; perdure doctor --data DRIVE --fix COPY leaves others out" : "");
  if (!parseNumbers({fields.begin() + 1, fields.end()}))
    return std::string("not seven numbers; ") + kImuColumns;
  return {};
}

/// Returns whether the header names accelerations before angular rates.
bool namesForceFirst(const std::vector<std::string>& head) {
  if (head.size() != 7) return false;
  const auto isForce = [](const std::string& name) {
    return (name.starts_with('a') && !name.starts_with("ang")) || name.starts_with("lin");
  };
  const auto isTurn = [](const std::string& name) {
    return name.starts_with('w') || name.starts_with('g') || name.starts_with("omega") ||
           name.starts_with("ang");
  };
  return std::all_of(head.begin() + 1, head.begin() + 4, isForce) &&
         std::all_of(head.begin() + 4, head.end(), isTurn);
}

void readImu(const fs::path& folder, Recording& recording) {
  const fs::path file = folder / "data.csv";
  const SensorTable table(file, "imu", recording, judgeImu);
  if (table.rows().empty()) {
    throw StartupError(ExitCode::kData,
                       "{} has no inertial sample (a head at most); fetch it again, or see why the "
                       "recorder wrote none",
                       file.c_str());
  }
  const bool force_first = namesForceFirst(table.head());
  if (force_first) {
    recording.notes.push_back(file.string() +
                              ": its head names accelerations before rates of turn; taken so");
  }
  for (const TableRow& row : table.rows()) {
    const auto v = parseNumbers({row.fields.begin() + 1, row.fields.end()});
    ImuSample sample;
    sample.time = row.time;
    sample.gyro = Eigen::Map<const Eigen::Vector3d>(v->data() + (force_first ? 3 : 0));
    sample.accel = Eigen::Map<const Eigen::Vector3d>(v->data() + (force_first ? 0 : 3));
    sample.sequence = recording.imu.size();
    recording.imu.push_back(sample);
  }
}

void readSpeed(const fs::path& folder, Recording& recording) {
  const double sigma = SensorFile(folder / "sensor.yaml").number("sigma", 1e-6);
  const SensorTable table(folder / "data.csv", "speed", recording, [](const Fields& fields) {
    const bool whole = fields.size() >= 2 && parseNumber(fields[1]);
    return whole ? "" : "not two numbers; timestamp [ns] and speed [m/s] are awaited";
  });
  for (const TableRow& row : table.rows()) {
    SpeedSample sample;
    sample.time = row.time;
    sample.sequence = recording.speed.size();
    sample.speed = *parseNumber(row.fields[1]);
    sample.sigma = sigma;
    recording.speed.push_back(sample);
  }
  recording.calibration.has_speed = !recording.speed.empty();
}

/// The list of a camera's frames, with the paths of its images.
class FrameList {
 public:
  /// If `look` is true, the images must exist; close() checks this.
  FrameList(const fs::path& folder, bool look)
      : folder_(folder), look_(look), images_(look ? folder / "data" : fs::path()) {}

  std::string pathOf(const TableRow& row) {
    const std::string_view name = row.fields.size() > 1 ? row.fields[1] : std::string_view();
    const fs::path written = folder_ / "data" / name;
    ++named_;
    if (!look_) return written.string();
    const auto found = images_.find(name, row.time);
    if (found) ++found_;
    if (found_ == 0 && named_ == 1) first_ = std::string(name);
    return found ? found->string() : written.string();
  }

  /// Throws StartupError if none of the listed images exists. Otherwise notes images that were
  /// found under other names.
  void close(Recording& recording) const {
    if (!look_ || named_ == 0) return;
    const std::string images = (folder_ / "data").string();
    const std::string list = (folder_ / "data.csv").string();
    if (found_ == 0 && images_.size() == 0) {
      const std::string others = images_.others();
      throw StartupError(ExitCode::kData, "{} names {} images, the first of them `{}`; {} holds {}",
                         list, named_, first_, images,
                         others.empty() ? "no file: unpack or copy them into it" : others);
    }
    if (found_ == 0) {
      throw StartupError(
          ExitCode::kData,
          "{} names {} images, {} holds {}, and none agrees: the first of the list is `{}`, that "
          "of the folder `{}`; the second column must hold the names of the files, or the stamps "
          "must be their names",
          list, named_, images, images_.size(), first_, images_.first());
    }
    if (images_.size() > found_) recording.reasons.add("frame_unlisted", images_.size() - found_);
    if (images_.foundOtherwise() == 0) return;
    recording.notes.push_back(
        fmt::format("{}: {} of {} images are not there by the name in the list and were found by "
                    "its stem or stamp",
                    list, images_.foundOtherwise(), named_));
  }

 private:
  fs::path folder_;
  bool look_;
  ImageFolder images_;
  std::size_t named_ = 0, found_ = 0;
  std::string first_;
};

/// Reads the frames of one camera; frames of cam1 have the index of cam0's frame at the same time.
void readFrames(const fs::path& folder, std::size_t camera, bool look, Recording& recording) {
  const SensorTable table(folder / "data.csv", camera == 0 ? "frame" : "stereo", recording,
                          [](const Fields&) { return std::string(); });
  const std::vector<Recording::FrameFile> first = recording.frames;
  FrameList list(folder, look);
  if (camera == 0) recording.frame_count = table.lines();
  if (camera == 0 && table.rows().empty()) {
    throw StartupError(ExitCode::kData, (folder / "data.csv").string() +
                                            " has no frame (a head at most); fetch it again, or "
                                            "list stamp and file of each image in it");
  }
  for (const TableRow& row : table.rows()) {
    // Numbers count skipped rows too, unless the list was out of order and is numbered again.
    const std::uint64_t number = table.wasSorted() ? row.number : recording.frames.size();
    Recording::FrameFile frame{row.time, number, camera, list.pathOf(row)};
    if (camera != 0 && !pairWith(first, frame, recording)) continue;
    recording.frames.push_back(std::move(frame));
  }
  list.close(recording);
}

PoseFile readGroundTruth(const fs::path& file, const RigidTransform& T_BI, Recording& recording) {
  const auto unitOf = [](const std::vector<double>& v) {
    return Eigen::Quaterniond(v[3], v[4], v[5], v[6]);
  };
  const SensorTable table(file, "truth", recording, [&](const Fields& fields) -> std::string {
    if (fields.size() < 8) return "fewer than eight columns: timestamp [ns], p, q (w x y z)";
    const auto v = parseNumbers({fields.begin() + 1, fields.begin() + 8});
    if (!v) return "not eight numbers";
    return std::abs(unitOf(*v).norm() - 1.0) > 1e-2 ? "the quaternion's norm is not 1" : "";
  });
  std::vector<StampedPose> poses;
  for (const TableRow& row : table.rows()) {
    const auto v = *parseNumbers({row.fields.begin() + 1, row.fields.begin() + 8});
    poses.push_back({row.time, RigidTransform(unitOf(v), {v[0], v[1], v[2]}) * T_BI});
  }
  return PoseFile(PoseFormat::kTum, std::move(poses));
}

void readTruth(const fs::path& mav0, const RigidTransform& T_BI, Recording& recording) {
  fs::path euroc = mav0 / "state_groundtruth_estimate0" / "data.csv";
  if (!fs::exists(euroc)) euroc = mav0 / "mocap0" / "data.csv";  // file name in TUM-VI
  const fs::path tum = mav0.parent_path() / "gt_tum.txt";
  if (fs::exists(euroc)) {
    recording.truth = readGroundTruth(euroc, T_BI, recording);
  } else if (fs::exists(tum)) {
    std::vector<StampedPose> poses = PoseFile::read(tum).poses();
    for (auto& pose : poses) pose.T_WB = pose.T_WB * T_BI;
    recording.truth = PoseFile(PoseFormat::kTum, std::move(poses));
  }
  if (recording.truth && recording.truth->poses().empty()) recording.truth.reset();
}

/// The path without a trailing slash, which shell completion adds.
fs::path cleanOf(const fs::path& folder) {
  const fs::path path = fs::absolute(folder).lexically_normal();
  return path.has_filename() ? path : path.parent_path();
}

fs::path mav0Of(const fs::path& folder) {
  return fs::is_directory(folder / "mav0") ? folder / "mav0" : folder;
}

/// Returns whether `of` is a separate word in a name, as in imu0.yaml but not in simulation.yaml.
bool isWordIn(const std::string& name, const std::string& of) {
  const auto isLetter = [&](std::size_t i) {
    return i < name.size() && std::isalpha(static_cast<unsigned char>(name[i])) != 0;
  };
  for (auto at = name.find(of); at != std::string::npos; at = name.find(of, at + 1)) {
    if ((at == 0 || !isLetter(at - 1)) && !isLetter(at + of.size())) return true;
  }
  return false;
}

/// Returns Kalibr's result files of the cameras (`of` is "camchain") or of the IMU ("imu") in mav0,
/// in the folder above it and in TUM-VI's folder `dso`. Callers use the first.
std::vector<fs::path> kalibrFiles(const fs::path& mav0, const std::string& of) {
  constexpr char kChain[] = "camchain";
  std::vector<fs::path> all;
  for (const fs::path& folder : {mav0, mav0.parent_path(), mav0.parent_path() / "dso"}) {
    const auto found = pathsIn(folder, [&](const fs::path& file) {
      const std::string name = file.filename().string();
      const bool is_yaml = file.extension() == ".yaml" || file.extension() == ".yml";
      const bool is_chain = name.find(kChain) != std::string::npos;
      return is_yaml && (of == kChain ? is_chain : !is_chain && isWordIn(name, of));
    });
    all.insert(all.end(), found.begin(), found.end());
  }
  return all;
}

/// If there are several files, notes which of them is used.
void noteChoice(const std::vector<fs::path>& files, Recording& recording) {
  if (files.size() < 2) return;
  std::vector<std::string> others;
  for (std::size_t i = 1; i < files.size(); ++i) others.push_back(files[i].string());
  const std::string note =
      fmt::format("the calibration is that of {}, not of {}; --rig FILE takes another",
                  files[0].string(), fmt::join(others, ", "));
  const auto& notes = recording.notes;
  if (std::find(notes.begin(), notes.end(), note) == notes.end()) recording.notes.push_back(note);
}

/// The calibration of a folder. Its sources, in order of precedence: each sensor's sensor.yaml, the
/// given rig file, and Kalibr's files (camchain*.yaml, imu*.yaml).
class EurocCalibration {
 public:
  EurocCalibration(const fs::path& mav0, const fs::path& rig) : mav0_(mav0) {
    if (!rig.empty()) rig_ = readRig(rig);
    if (rig_) return;
    chains_ = kalibrFiles(mav0, "camchain");
    if (!chains_.empty()) rig_ = readRig(chains_.front());
  }

  ImuCalibration imu(Recording& recording) {
    fs::path path = mav0_ / "imu0" / "sensor.yaml";
    if (!fs::exists(path) && rig_ && rig_->imu) return *rig_->imu;
    if (!fs::exists(path)) {
      const auto files = kalibrFiles(mav0_, "imu");
      if (!files.empty()) path = files.front();
      noteChoice(files, recording);
    }
    SensorFile file(path);
    if (file.has("imu0")) file = file.section("imu0");
    T_BI_ = file.T_BS();
    T_I_reference_ = file.transform("T_i_b").value_or(RigidTransform());
    const ImuCalibration imu = readImuCalibration(file);
    file.noteUnknownKeys(recording.notes);
    return imu;
  }

  CameraCalibration camera(const std::string& name, Recording& recording) const {
    const fs::path path = mav0_ / name / "sensor.yaml";
    const CameraCalibration* in_rig = rig_ ? rig_->camera(name) : nullptr;
    if (!fs::exists(path) && in_rig) {
      noteChoice(chains_, recording);
      CameraCalibration camera = *in_rig;
      camera.T_BC = T_I_reference_ * camera.T_BC;
      return camera;
    }
    SensorFile file(path);
    if (file.has(name)) file = file.section(name);
    CameraCalibration camera = readCamera(file, name);
    file.noteUnknownKeys(recording.notes);
    camera.T_BC = T_BI_.inverse() * camera.T_BC;
    return camera;
  }

  const RigidTransform& T_BI() const { return T_BI_; }

 private:
  fs::path mav0_;
  std::vector<fs::path> chains_;  ///< Kalibr's files of the cameras; the first was read into rig_
  std::optional<Calibration> rig_;
  RigidTransform T_BI_;  ///< pose of the IMU in EuRoC's body, the frame of all data in the files
  RigidTransform
      T_I_reference_;  ///< pose of Kalibr's reference IMU in this IMU, if there are several
};

}  // namespace

bool looksLikeEuroc(const fs::path& folder) {
  return fs::is_directory(folder / "mav0") || cleanOf(folder).filename() == "mav0";
}

Recording readEuroc(const DatasetOptions& options) {
  const fs::path mav0 = mav0Of(cleanOf(options.path));
  Recording recording;
  recording.kind = DatasetKind::kEuroc;
  for (const char* sensor : {"cam0", "imu0"}) {
    if (!fs::exists(mav0 / sensor / "data.csv")) {
      throwMissing(mav0 / sensor / "data.csv", "a part of the EuRoC folder", "unpack it whole");
    }
  }
  EurocCalibration calibration(mav0, options.rig);
  recording.calibration.imu = calibration.imu(recording);
  readImu(mav0 / "imu0", recording);
  for (const std::string name : {"cam0", "cam1"}) {
    if (!fs::exists(mav0 / name / "data.csv")) continue;
    if (options.decode && !fs::is_directory(mav0 / name / "data")) {
      throwMissing(mav0 / name / "data", "the folder of images",
                   "unpack the images (or the video) into it");
    }
    recording.calibration.cameras.push_back(calibration.camera(name, recording));
    readFrames(mav0 / name, recording.calibration.cameras.size() - 1, options.decode, recording);
    double& rate = recording.calibration.cameras.back().rate_hz;
    if (rate <= 0.0) rate = rateOf(recording.frames, recording.calibration.cameras.size() - 1);
  }
  if (fs::exists(mav0 / "speed0" / "data.csv")) readSpeed(mav0 / "speed0", recording);
  for (const char* sensor : {"cam1", "speed0"}) {
    const fs::path folder = mav0 / sensor;
    if (!fs::is_directory(folder) || fs::exists(folder / "data.csv")) continue;
    recording.notes.push_back(folder.string() + " has no data.csv and is left out");
  }
  sortFrames(recording);
  readTruth(mav0, calibration.T_BI(), recording);
  return recording;
}

}  // namespace perdure::replay
