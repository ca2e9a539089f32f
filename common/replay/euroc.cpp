// EuRoC ASL folders: mav0/{cam0,cam1,imu0,state_groundtruth_estimate0}, CSVs and sensor.yaml, and
// where there is one speed0 (`#timestamp [ns],speed [m s^-1]`), which simulated vehicles have.
// The body is the IMU: where imu0's T_BS is not the identity, everything is moved to it.
#include <algorithm>
#include <cmath>

#include "common/base/errors.h"
#include "common/replay/files/sensor_file.h"
#include "common/replay/files/text_file.h"
#include "common/replay/recording.h"

namespace perdure::replay {
namespace {

namespace fs = std::filesystem;

/// Calls `row` with the stamp and the fields of each line that has at least `count` fields and
/// a stamp; counts `code` for the others.
template <class Row>
void readCsv(const fs::path& file, std::size_t count, const char* code, ReasonCounts& reasons,
             Row&& row) {
  for (const auto& line : readLines(file, "EuRoC keeps data.csv in each sensor's folder")) {
    if (line.text.starts_with('#')) continue;
    const auto fields = split(line.text, ',');
    const auto stamp = parseInteger(fields[0]);
    if (fields.size() < count || !stamp || *stamp < 0) {
      reasons.add(code);
    } else if (!row(fromNanoseconds(*stamp), fields)) {
      reasons.add(code);
    }
  }
}

void readImu(const fs::path& folder, Recording& recording) {
  const auto row = [&](TimePoint time, const std::vector<std::string_view>& fields) {
    const auto v = parseNumbers({fields.begin() + 1, fields.begin() + 7});
    if (!v) return false;
    ImuSample sample;
    sample.time = time;
    sample.gyro = Eigen::Map<const Eigen::Vector3d>(v->data());
    sample.accel = Eigen::Map<const Eigen::Vector3d>(v->data() + 3);
    appendImu(recording, sample);
    return true;
  };
  readCsv(folder / "data.csv", 7, "imu_malformed", recording.reasons, row);
  if (recording.imu.empty())
    throwMissing(folder / "data.csv", "any inertial sample", "fetch it again");
}

void readSpeed(const fs::path& folder, Recording& recording) {
  const double sigma = SensorFile(folder / "sensor.yaml").number("sigma", 1e-6);
  const auto row = [&](TimePoint time, const std::vector<std::string_view>& fields) {
    const auto value = parseNumber(fields[1]);
    if (!value || (!recording.speed.empty() && time <= recording.speed.back().time)) return false;
    SpeedSample sample;
    sample.time = time;
    sample.sequence = recording.speed.size();
    sample.speed = *value;
    sample.sigma = sigma;
    recording.speed.push_back(sample);
    return true;
  };
  readCsv(folder / "data.csv", 2, "speed_malformed", recording.reasons, row);
  recording.calibration.has_speed = !recording.speed.empty();
}

/// Frames of one camera; cam1's frames take the index of cam0's frame at the same time.
void readFrames(const fs::path& folder, std::size_t camera, Recording& recording) {
  constexpr Duration kSame = std::chrono::milliseconds(5);
  std::vector<Recording::FrameFile> first = recording.frames;
  const auto row = [&](TimePoint time, const std::vector<std::string_view>& fields) {
    Recording::FrameFile frame{time, recording.frame_count, camera,
                               (folder / "data" / fields[1]).string()};
    if (camera == 0) {
      if (!recording.frames.empty() && time <= recording.frames.back().time) return false;
      ++recording.frame_count;
    } else {
      const auto pair = std::find_if(first.begin(), first.end(), [&](const auto& other) {
        return std::abs((other.time - time).count()) <= kSame.count();
      });
      if (pair == first.end()) return false;
      frame.index = pair->index;
      frame.time = pair->time;
    }
    recording.frames.push_back(std::move(frame));
    return true;
  };
  readCsv(folder / "data.csv", 2, camera == 0 ? "frame_malformed" : "stereo_unmatched",
          recording.reasons, row);
}

PoseFile readGroundTruth(const fs::path& file, const RigidTransform& T_BI, ReasonCounts& reasons) {
  std::vector<StampedPose> poses;
  const auto row = [&](TimePoint time, const std::vector<std::string_view>& fields) {
    const auto v = parseNumbers({fields.begin() + 1, fields.begin() + 8});
    if (!v || (!poses.empty() && time <= poses.back().time)) return false;
    const Eigen::Quaterniond q((*v)[3], (*v)[4], (*v)[5], (*v)[6]);
    if (std::abs(q.norm() - 1.0) > 1e-2) return false;
    poses.push_back({time, RigidTransform(q, {(*v)[0], (*v)[1], (*v)[2]}) * T_BI});
    return true;
  };
  readCsv(file, 8, "truth_malformed", reasons, row);
  return PoseFile(PoseFormat::kTum, std::move(poses));
}

void readTruth(const fs::path& mav0, const RigidTransform& T_BI, Recording& recording) {
  const fs::path euroc = mav0 / "state_groundtruth_estimate0" / "data.csv";
  const fs::path tum = mav0.parent_path() / "gt_tum.txt";
  if (fs::exists(euroc)) {
    recording.truth = readGroundTruth(euroc, T_BI, recording.reasons);
  } else if (fs::exists(tum)) {
    std::vector<StampedPose> poses = PoseFile::read(tum).poses();
    for (auto& pose : poses) pose.T_WB = pose.T_WB * T_BI;
    recording.truth = PoseFile(PoseFormat::kTum, std::move(poses));
  }
  if (recording.truth && recording.truth->poses().empty()) recording.truth.reset();
}

fs::path mav0Of(const fs::path& folder) {
  return fs::is_directory(folder / "mav0") ? folder / "mav0" : folder;
}

}  // namespace

bool looksLikeEuroc(const fs::path& folder) {
  return fs::is_directory(folder / "mav0") || folder.filename() == "mav0";
}

Recording readEuroc(const DatasetOptions& options) {
  const fs::path mav0 = mav0Of(fs::absolute(options.path).lexically_normal());
  Recording recording;
  recording.kind = DatasetKind::kEuroc;
  for (const char* sensor : {"cam0", "imu0"}) {
    if (!fs::exists(mav0 / sensor / "data.csv")) {
      throwMissing(mav0 / sensor / "data.csv", "a part of the EuRoC folder", "unpack it whole");
    }
  }
  const SensorFile imu(mav0 / "imu0" / "sensor.yaml");
  recording.calibration.imu = readImuCalibration(imu);
  readImu(mav0 / "imu0", recording);
  for (const std::string name : {"cam0", "cam1"}) {
    if (!fs::exists(mav0 / name / "data.csv")) continue;
    if (options.decode && !fs::is_directory(mav0 / name / "data")) {
      throwMissing(mav0 / name / "data", "the folder of images",
                   "unpack the images (or the video) into it");
    }
    const SensorFile file(mav0 / name / "sensor.yaml");
    recording.calibration.cameras.push_back(readCamera(file, name));
    CameraCalibration& camera = recording.calibration.cameras.back();
    camera.T_BC = imu.T_BS().inverse() * camera.T_BC;
    readFrames(mav0 / name, recording.calibration.cameras.size() - 1, recording);
  }
  if (fs::exists(mav0 / "speed0" / "data.csv")) readSpeed(mav0 / "speed0", recording);
  sortFrames(recording);
  readTruth(mav0, imu.T_BS(), recording);
  return recording;
}

}  // namespace perdure::replay
