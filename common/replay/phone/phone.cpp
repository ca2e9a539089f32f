// Recordings of phones: separate streams of gyroscope and accelerometer, frames in a film or as
// images, and rarely a calibration. The formats are read by tables.cpp and records.cpp; this file
// joins their parts.
#include <fmt/format.h>

#include <algorithm>

#include "common/base/algorithms/median.h"
#include "common/base/errors.h"
#include "common/replay/files/rig_file.h"
#include "common/replay/files/stamps.h"
#include "common/replay/phone/parts.h"

namespace perdure::replay {
namespace phone {

Duration widestOf(const Stream& stream) {
  std::vector<Duration> intervals;
  for (std::size_t i = 1; i < stream.size(); ++i) {
    intervals.push_back(between(stream[i].time, stream[i - 1].time));
  }
  return multipleOf(7, medianOf(std::move(intervals))) / 2;
}

std::optional<Eigen::Vector3d> valueAt(const Stream& stream, TimePoint time, Duration widest) {
  const auto after = std::lower_bound(
      stream.begin(), stream.end(), time,
      [](const Reading& reading, TimePoint wanted) { return reading.time < wanted; });
  if (after == stream.end()) return std::nullopt;
  if (after->time == time) return after->value;
  if (after == stream.begin()) return std::nullopt;
  const Reading& before = *std::prev(after);
  const Duration gap = between(after->time, before.time);
  if (gap > widest) return std::nullopt;
  const double share = toSeconds(between(time, before.time)) / toSeconds(gap);
  return (1.0 - share) * before.value + share * after->value;
}

namespace {

/// In this order, because a MARS folder also has the files of kFilmWithTables.
const Format* formatOf(const std::filesystem::path& folder) {
  for (const Format* format : {&kMarsLogger, &kSpectacularAi, &kSensorLogger, &kIosLogger,
                               &kFilmWithTables, &kJsonRecords}) {
    if (format->looks(folder)) return format;
  }
  return nullptr;
}

Parts readParts(const std::filesystem::path& path, Recording& recording) {
  const Format* format = formatOf(path);
  return (format == nullptr ? kGoPro : *format).read(path, recording);
}

void requireReadings(const Parts& parts) {
  const bool gyro = parts.gyro.empty();
  if (!gyro && !parts.accel.empty()) return;
  throw StartupError(ExitCode::kData,
                     "{} has no sample of the {}; record gyroscope and accelerometer together",
                     parts.where, gyro ? "gyroscope" : "accelerometer");
}

std::string rangeOf(const Stream& stream) {
  return fmt::format("{} … {} ns", toNanoseconds(stream.front().time),
                     toNanoseconds(stream.back().time));
}

/// Adds a sample at each stamp of the gyroscope, with the interpolated specific force.
void joinImu(const Parts& parts, Recording& recording) {
  requireReadings(parts);
  const Duration widest = widestOf(parts.accel);
  for (const Reading& gyro : parts.gyro) {
    const auto accel = valueAt(parts.accel, gyro.time, widest);
    if (!accel || !accel->allFinite() || !gyro.value.allFinite()) continue;
    ImuSample sample;
    sample.time = gyro.time, sample.sequence = recording.imu.size();
    sample.gyro = gyro.value, sample.accel = *accel;
    recording.imu.push_back(sample);
  }
  const std::size_t lost = parts.gyro.size() - recording.imu.size();
  if (recording.imu.empty()) {
    throw StartupError(ExitCode::kData,
                       "{}: gyroscope ({}) and accelerometer ({}) have no time in common: their "
                       "stamps are of two clocks or in two units; record them with one clock",
                       parts.where, rangeOf(parts.gyro), rangeOf(parts.accel));
  }
  if (lost == 0) return;
  recording.reasons.add("imu_unpaired", lost);
  if (100 * lost <= parts.gyro.size()) return;
  recording.notes.push_back(
      fmt::format("{}: {} of {} samples of the gyroscope ({}) have no reading of the accelerometer "
                  "({}) nearby and were left out",
                  parts.where, lost, parts.gyro.size(), rangeOf(parts.gyro), rangeOf(parts.accel)));
}

/// Pauses of the accelerometer show as pauses of the joined samples.
void dropPausesOfAccel(Recording& recording) {
  std::erase_if(recording.clock_changes, [](const ClockChange& change) {
    return change.sensor == "accel" && change.kind == ClockChange::Kind::kPause;
  });
}

/// Noise of the IMU, which no phone records. The values are assumed, not estimated: larger than
/// those of the sensors' data sheets, because errors of scale, temperature and vibration add to
/// them.
ImuCalibration usualNoise(const std::vector<ImuSample>& samples) {
  ImuCalibration imu;
  imu.gyro_noise = 5e-4, imu.gyro_bias_walk = 2e-5;
  imu.accel_noise = 6e-3, imu.accel_bias_walk = 5e-4;
  std::vector<double> intervals;
  for (std::size_t i = 1; i < samples.size(); ++i) {
    intervals.push_back(toSeconds(samples[i].time - samples[i - 1].time));
  }
  const double interval = medianOf(std::move(intervals));
  imu.rate_hz = interval > 0.0 ? 1.0 / interval : 0.0;
  return imu;
}

void requireCalibration(const DatasetOptions& options, const CameraCalibration& camera) {
  if (camera.fx > 0.0 || options.uncalibrated || !options.rig.empty()) return;
  const std::string data = options.path.string();
  throw StartupError(
      ExitCode::kUnavailable,
      "{0}: the lens of {1}, or its pose on the inertial unit, is not in the recording; give a rig "
      "file with --rig, or let it be found from the motion: --rig auto (pipeline), or `perdure "
      "calibrate from-motion --data {0} --out rig.yaml`",
      data, camera.name);
}

}  // namespace
}  // namespace phone

bool looksLikePhone(const std::filesystem::path& folder) {
  return phone::formatOf(folder) != nullptr;
}

bool looksLikeGoPro(const std::filesystem::path& path) { return phone::kGoPro.looks(path); }

Recording readPhone(const DatasetOptions& options) {
  Recording recording;
  recording.kind = DatasetKind::kPhone;
  const phone::Parts parts = phone::readParts(options.path, recording);
  phone::dropPausesOfAccel(recording);
  phone::joinImu(parts, recording);
  recording.calibration.imu = phone::usualNoise(recording.imu);
  if (options.rig.empty() || !readRig(options.rig).imu) {
    recording.notes.push_back(parts.where +
                              ": the noise of the inertial unit is not in the recording, and that "
                              "of usual phones is taken; imu0 in a rig file sets it");
  }
  for (std::size_t i = 0; i < parts.cameras.size(); ++i) {
    recording.calibration.cameras.push_back(
        phone::addFrames(parts.cameras[i], i, options, recording));
    phone::requireCalibration(options, recording.calibration.cameras.back());
  }
  sortFrames(recording);
  return recording;
}

}  // namespace perdure::replay
