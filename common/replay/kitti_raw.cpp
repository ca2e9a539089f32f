// KITTI raw drives (*_sync): image_02 and image_03, and OXTS as inertial samples and speed. The
// body is the IMU of the OXTS unit: x forward, y left, z up. Stamps are those of the files (OXTS is
// 7 ms after the images). The right image has the stamp of the left one, because one trigger
// exposes both.
#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "common/base/errors.h"
#include "common/replay/files/kitti_calibration.h"
#include "common/replay/files/text_file.h"
#include "common/replay/recording.h"

namespace perdure::replay {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kOxtsFields = 30;
enum OxtsField : std::size_t {
  kLat = 0,
  kLon,
  kAlt,
  kRoll,
  kPitch,
  kYaw,
  kVf = 8,
  kAx = 11,
  kWx = 17
};

std::string tenDigits(std::size_t number) { return fmt::format("{:010}", number); }

/// Parses "2011-09-26 13:04:32.345808896" as UTC.
std::optional<TimePoint> parseStamp(const std::string& text) {
  int year = 0, month = 0, day = 0, hour = 0, minute = 0, second = 0, used = 0;
  if (std::sscanf(text.c_str(), "%d-%d-%d %d:%d:%d%n", &year, &month, &day, &hour, &minute, &second,
                  &used) != 6) {
    return std::nullopt;
  }
  const std::chrono::year_month_day date{std::chrono::year(year),
                                         std::chrono::month(static_cast<unsigned>(month)),
                                         std::chrono::day(static_cast<unsigned>(day))};
  const auto below = [](int value, int most) { return value >= 0 && value < most; };
  if (!date.ok() || year < 1970 || year > 2200) return std::nullopt;
  if (!below(hour, 24) || !below(minute, 60) || !below(second, 61)) return std::nullopt;
  std::string digits = "0";
  if (text[static_cast<std::size_t>(used)] == '.')
    digits = text.substr(static_cast<std::size_t>(used) + 1, 9);
  digits.resize(9, '0');
  const auto fraction = parseInteger(digits);
  if (!fraction || *fraction < 0) return std::nullopt;
  const Duration since = std::chrono::sys_days(date).time_since_epoch() + std::chrono::hours(hour) +
                         std::chrono::minutes(minute) + std::chrono::seconds(second);
  return TimePoint(since + Duration(*fraction));
}

/// Reads the stamps; line k has that of record k. An entry is empty if its line is no stamp.
std::vector<std::optional<TimePoint>> readStamps(const fs::path& file) {
  std::vector<std::optional<TimePoint>> stamps;
  for (const auto& line : readLines(file, "KITTI keeps timestamps.txt in each sensor's folder")) {
    stamps.resize(line.number);
    stamps.back() = parseStamp(line.text);
  }
  return stamps;
}

/// The folder with the three calibration files: the drive's folder or its parent.
fs::path calibrationFolder(const fs::path& drive) {
  const fs::path path = fs::absolute(drive).lexically_normal();
  const fs::path clean = path.has_filename() ? path : path.parent_path();
  for (const auto& folder : {clean, clean.parent_path()}) {
    if (fs::exists(folder / "calib_cam_to_cam.txt")) return folder;
  }
  throwMissing(clean.parent_path() / "calib_cam_to_cam.txt", "the drive's calibration",
               "unpack KITTI's calibration of that day (calib_cam_to_cam.txt, "
               "calib_velo_to_cam.txt, calib_imu_to_velo.txt) beside or above the drive");
}

/// The OXTS unit as an IMU. Its records are instantaneous values at 10 Hz, not averages. The noise
/// densities therefore stand for the unknown motion between two records.
ImuCalibration oxtsCalibration() {
  ImuCalibration imu;
  imu.gyro_noise = 5e-3;
  imu.gyro_bias_walk = 1e-5;
  imu.accel_noise = 0.15;
  imu.accel_bias_walk = 1e-3;
  imu.rate_hz = 10.0;
  return imu;
}

struct OxtsRecord {
  TimePoint time;
  std::size_t index = 0;
  std::vector<double> values;
};

/// Orders records by time. Their member `index` gives the line for messages.
template <class Record>
void orderByLine(std::vector<Record>& records, const char* kind, const fs::path& file,
                 Recording& recording) {
  orderByTime(
      records, kind, file.string(), std::to_string(records.size()), recording,
      [&](std::size_t i) { return fmt::format("{}:{}", file.string(), records[i].index + 1); });
}

std::vector<OxtsRecord> readOxts(const fs::path& folder, Recording& recording) {
  ReasonCounts& reasons = recording.reasons;
  std::vector<OxtsRecord> records;
  const auto stamps = readStamps(folder / "timestamps.txt");
  for (std::size_t i = 0; i < stamps.size(); ++i) {
    const fs::path file = folder / "data" / (tenDigits(i) + ".txt");
    if (!fs::exists(file)) {
      reasons.add("imu_missing");
      continue;
    }
    const auto lines = readLines(file, "");
    const auto values = lines.empty() ? std::nullopt : parseNumbers(split(lines.front().text, ' '));
    if (!stamps[i] || !values || values->size() < kOxtsFields - 5) {
      reasons.add("imu_malformed");
      continue;
    }
    records.push_back({*stamps[i], i, *values});
  }
  orderByLine(records, "imu", folder / "timestamps.txt", recording);
  return records;
}

/// The pose in an east-north-up frame at the first record's position, by a Mercator projection with
/// the scale of its latitude, as in KITTI's development kit.
RigidTransform poseOf(const OxtsRecord& record, const OxtsRecord& first) {
  constexpr double kEarthRadius = 6378137.0, kRadians = std::numbers::pi / 180.0;
  const double* v = record.values.data();
  const double* o = first.values.data();
  const auto north = [](double latitude_deg) {
    return std::log(std::tan((90.0 + latitude_deg) * kRadians / 2.0));
  };
  const double metres = kEarthRadius * std::cos(o[kLat] * kRadians);
  const Eigen::Quaterniond q = Eigen::AngleAxisd(v[kYaw], Eigen::Vector3d::UnitZ()) *
                               Eigen::AngleAxisd(v[kPitch], Eigen::Vector3d::UnitY()) *
                               Eigen::AngleAxisd(v[kRoll], Eigen::Vector3d::UnitX());
  return RigidTransform(q, {metres * (v[kLon] - o[kLon]) * kRadians,
                            metres * (north(v[kLat]) - north(o[kLat])), v[kAlt] - o[kAlt]});
}

PoseFile truthOf(const std::vector<OxtsRecord>& records) {
  std::vector<StampedPose> poses;
  for (const auto& record : records) {
    poses.push_back({record.time, poseOf(record, records.front())});
  }
  return PoseFile(PoseFormat::kTum, std::move(poses));
}

void addOxts(const std::vector<OxtsRecord>& records, Recording& recording) {
  for (const auto& record : records) {
    const double* v = record.values.data();
    ImuSample sample;
    sample.time = record.time;
    sample.accel = Eigen::Vector3d(v[kAx], v[kAx + 1], v[kAx + 2]);
    sample.gyro = Eigen::Vector3d(v[kWx], v[kWx + 1], v[kWx + 2]);
    sample.sequence = recording.imu.size();
    recording.imu.push_back(sample);
    SpeedSample speed;
    speed.time = record.time;
    speed.sequence = recording.speed.size();
    speed.speed = v[kVf];
    recording.speed.push_back(speed);
  }
  const OxtsRecord& first = records.front();
  GeoAnchor anchor;
  anchor.time = first.time;
  anchor.latitude_deg = first.values[kLat];
  anchor.longitude_deg = first.values[kLon];
  anchor.height_m = first.values[kAlt];
  anchor.yaw = first.values[kYaw];
  recording.calibration.anchor = anchor;
  recording.calibration.has_speed = true;
  recording.calibration.imu = oxtsCalibration();
}

void addCamera(const fs::path& folder, const std::vector<std::optional<TimePoint>>& stamps,
               const CameraCalibration& camera, Recording& recording) {
  const std::size_t number = recording.calibration.cameras.size();
  recording.calibration.cameras.push_back(camera);
  std::vector<Recording::FrameFile> frames;
  for (std::size_t i = 0; i < stamps.size(); ++i) {
    if (!stamps[i]) {
      recording.reasons.add("frame_malformed");
      continue;
    }
    frames.push_back({*stamps[i], i, number, imagePath(folder / "data", tenDigits(i)).string()});
  }
  orderByLine(frames, "frame", folder / "timestamps.txt", recording);
  recording.frames.insert(recording.frames.end(), frames.begin(), frames.end());
}

/// Adds the right camera. Its images get the stamps of the left ones, so that a step of the clock
/// is counted once.
void addRightCamera(const fs::path& folder, const CameraCalibration& camera, Recording& recording) {
  recording.calibration.cameras.push_back(camera);
  for (std::size_t i = 0, left = recording.frames.size(); i < left; ++i) {
    auto frame = recording.frames[i];
    frame.camera = 1, frame.path = imagePath(folder / "data", tenDigits(frame.index)).string();
    recording.frames.push_back(std::move(frame));
  }
}

}  // namespace

bool looksLikeKittiRaw(const fs::path& folder) {
  return fs::is_directory(folder / "image_02") || fs::is_directory(folder / "oxts");
}

Recording readKittiRaw(const DatasetOptions& options) {
  const fs::path& drive = options.path;
  for (const char* part :
       {"image_02/data", "image_02/timestamps.txt", "oxts/data", "oxts/timestamps.txt"}) {
    if (!fs::exists(drive / part)) {
      throwMissing(drive / part, "a part of the KITTI drive", "unpack the *_sync drive whole");
    }
  }
  const KittiCalibration calibration = readRawCalibration(calibrationFolder(drive));
  Recording recording;
  recording.kind = DatasetKind::kKittiRaw;
  const auto records = readOxts(drive / "oxts", recording);
  if (records.empty()) throwMissing(drive / "oxts" / "data", "any OXTS record", "fetch it again");
  const auto stamps = readStamps(drive / "image_02" / "timestamps.txt");
  recording.frame_count = stamps.size();
  addCamera(drive / "image_02", stamps, calibration.camera("cam0"), recording);
  if (fs::is_directory(drive / "image_03" / "data")) {
    addRightCamera(drive / "image_03", calibration.camera("cam1"), recording);
  }
  sortFrames(recording);
  addOxts(records, recording);
  recording.truth = truthOf(records);
  return recording;
}

}  // namespace perdure::replay
