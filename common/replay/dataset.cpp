#include "common/replay/dataset.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <set>

#include "common/base/algorithms/median.h"
#include "common/base/errors.h"
#include "common/base/files/access.h"
#include "common/replay/clock_check.h"
#include "common/replay/files/rig_file.h"
#include "common/replay/files/stamps.h"
#include "common/replay/files/text_file.h"
#include "common/replay/recording.h"
#include "common/replay/recordings/recorded_messages.h"
#include "common/replay/recordings/ros_messages.h"
#include "common/replay/recordings/unpacked_file.h"
#include "common/vision/decode.h"
#include "common/vision/image.h"
#include "common/vision/jpeg.h"

namespace perdure::replay {
namespace {

/// The median interval, or 0 if there are fewer than three samples.
Duration usualInterval(const std::vector<ImuSample>& samples) {
  if (samples.size() < 3) return Duration{0};
  std::vector<Duration> intervals;
  for (std::size_t i = 1; i < samples.size(); ++i) {
    intervals.push_back(between(samples[i].time, samples[i - 1].time));
  }
  return medianOf(std::move(intervals));
}

std::string nameOf(const Recording::FrameFile& file) {
  return file.path.empty() ? "frame " + std::to_string(file.index) : file.path;
}

/// Returns a copy, because the frame's pixels lie in a chunk of the recording.
Result<cv::Mat> recordedImage(const Recording::FrameFile& file,
                              std::optional<ImageEncoding> encoding) {
  const auto loaded = file.load();
  if (!loaded) return tl::unexpected(loaded.error());
  const auto frame = vision::decompressed(*loaded);
  if (!frame) return tl::unexpected(frame.error());
  const auto wanted = encoding.value_or(frame->encoding);
  const auto image =
      wanted == ImageEncoding::kMono8 ? vision::monoOf(*frame) : vision::bgrOf(*frame);
  if (!image) return image;
  return image->clone();
}

/// Keeps every N-th frame with its number; samples are unchanged.
void keepEach(std::size_t every, Recording& recording) {
  std::set<std::uint64_t> kept;
  std::size_t seen = 0;
  for (const auto& frame : recording.frames) {
    if (frame.camera == 0 && seen++ % every == 0) kept.insert(frame.index);
  }
  std::erase_if(recording.frames, [&](const auto& frame) { return !kept.contains(frame.index); });
  recording.frame_count = kept.size();
  for (CameraCalibration& camera : recording.calibration.cameras) {
    camera.rate_hz /= static_cast<double>(every);
  }
}

bool hasMessages(const std::filesystem::path& path) {
  return RecordedMessages::looksLikeOne(path) || RosMessages::looksLikeOne(path);
}

/// Reads a recording. Compressed files are unpacked only once, to detect their kind and to read
/// them.
Recording readMessages(const DatasetOptions& options) {
  const UnpackedFiles kept = unpackedFiles(options.path, ".mcap");
  return RosMessages::looksLikeOne(options.path) ? readRosDrive(options)
                                                 : readRecordedDrive(options);
}

/// Refuses an existing file whose name is not that of a readable format.
[[noreturn]] void refuseFile(const std::filesystem::path& path) {
  std::string head(16, '\0');
  std::ifstream(path, std::ios::binary)
      .read(head.data(), static_cast<std::streamsize>(head.size()));
  const bool bag = head.starts_with("#ROSBAG");
  const std::string name = path.string();
  std::string why = name +
                    " is not a recording that is known by its ending (.mcap, .bag, .db3, or "
                    "one of them packed)";
  if (path.extension() == ".active") {
    why = name + " is an unfinished bag: run `rosbag reindex` on it and name it .bag";
  } else if (bag) {
    why = name + " is a bag of ROS 1: name it .bag";
  } else if (head.starts_with("\x89MCAP0")) {
    why = name + " is an MCAP recording: name it .mcap";
  } else if (head.starts_with("SQLite format 3")) {
    why = name + " is a database of SQLite: where `ros2 bag record` made it, name it .db3";
  }
  throw StartupError(ExitCode::kData, why);
}

using Reader = Recording (*)(const DatasetOptions&);

std::optional<Reader> readerOf(const std::filesystem::path& folder) {
  if (looksLikeEuroc(folder)) return readEuroc;
  if (looksLikeKittiTracking(folder)) return readKittiTracking;
  if (looksLikeKittiRaw(folder)) return readKittiRaw;
  if (looksLikeSevenScenes(folder)) return readSevenScenes;
  if (looksLikePhone(folder)) return readPhone;
  return std::nullopt;
}

/// Refuses a dataset folder that also contains a recording file.
[[noreturn]] void refuseBoth(const std::filesystem::path& folder) {
  std::string file, part;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    const std::string name = entry.path().filename();
    const bool below = entry.is_directory();
    if (!below && hasMessages(entry.path())) file = name;
    if (below && (part.empty() || name < part)) part = name;
  }
  throw StartupError(ExitCode::kData,
                     "{} holds two recordings, the folder {} and {}: give that file, or move it "
                     "away for the folder",
                     folder.string(), part, file);
}

/// Lists the folders inside `folder` that are datasets or contain recordings.
std::string datasetsIn(const std::filesystem::path& folder) {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    const bool known =
        entry.is_directory() &&
        (readerOf(entry.path()) || hasMessages(entry.path()) || looksLikeGoPro(entry.path()));
    if (known) names.push_back(entry.path().filename());
  }
  std::ranges::sort(names);
  return fmt::format("{}", fmt::join(names, ", "));
}

Recording readRecording(const DatasetOptions& options) {
  const auto& path = options.path;
  if (!std::filesystem::is_directory(path)) {
    std::error_code error;
    if (std::filesystem::exists(path, error) && hasMessages(path)) return readMessages(options);
    if (looksLikeGoPro(path)) return readPhone(options);
    if (std::filesystem::is_regular_file(path, error)) refuseFile(path);
    throwMissing(
        path, "the dataset folder",
        "--data takes a folder in EuRoC, KITTI raw, KITTI tracking or 7-Scenes layout, the "
        "folder of a phone's logger, a film of a GoPro, or a recording (.mcap; of ROS also .db3 "
        "and .bag)");
  }
  const auto folder = readerOf(path);
  const bool messages = hasMessages(path);
  if (folder && messages) refuseBoth(path);
  if (folder) return (*folder)(options);
  if (messages) return readMessages(options);  // films beside them may be for people
  if (looksLikeGoPro(path)) return readPhone(options);
  if (const std::string names = datasetsIn(path); !names.empty()) {
    throw StartupError(ExitCode::kUnavailable,
                       "{} is no dataset folder, but it has {} inside: give --data one of these",
                       path.string(), names);
  }
  throw StartupError(ExitCode::kUnavailable,
                     path.string() +
                         " is no dataset folder that is known: give a folder with "
                         "mav0 (EuRoC), with image_02 and oxts (KITTI raw, *_sync), "
                         "with calib (KITTI tracking), with color and pose or "
                         "frame-000000.color.png and .pose.txt (7-Scenes), of a phone's logger "
                         "(with gyro_accel.csv, data.jsonl, NAME_gyro.csv and NAME_accel.csv, "
                         "Gyroscope.csv, Gyro.txt and Frames.txt, or JSON records of sensors), "
                         "with a film of a GoPro, or with recordings (.mcap, .db3, .bag)");
}

void numberFrames(Recording& recording) {
  for (const auto& frame : recording.frames) {
    if (frame.camera != 0) continue;
    const std::string stem = std::filesystem::path(frame.path).stem().string();
    recording.numbers.emplace(stem.empty() ? std::to_string(toNanoseconds(frame.time)) : stem,
                              frame.index);
  }
}

/// Reads a drive. Unreadable files look as if they were missing, so permissions are checked after a
/// failure and named as its cause.
Recording readReadable(const DatasetOptions& options) {
  try {
    Recording recording = readRecording(options);
    const auto& frames = recording.frames;
    if (options.decode && !frames.empty()) refuseUnreadable(frames.front().path);
    return recording;
  } catch (const std::runtime_error&) {
    const std::string why = whyUnreadableIn(options.path);
    if (why.empty()) throw;
    throw StartupError(ExitCode::kUnavailable, why);
  }
}

}  // namespace

std::unique_ptr<Dataset> Dataset::open(const DatasetOptions& options) {
  Recording recording = readReadable(options);
  settleClocks(recording);
  if (!options.rig.empty() && recording.kind != DatasetKind::kRosRecording) {
    const Calibration rig = readRig(options.rig, &recording.notes);
    applyRig(rig, options.rig.string(), recording.calibration);
  }
  numberFrames(recording);
  if (options.every > 1) keepEach(options.every, recording);
  return std::make_unique<Dataset>(options, std::move(recording));
}

Dataset::Dataset(const DatasetOptions& options, Recording recording)
    : options_(options), recording_(std::move(recording)), reasons_(recording_.reasons) {
  recording_.calibration.source = options_.source;
  usual_interval_ = usualInterval(recording_.imu);
}

std::optional<TimePoint> Dataset::frameTime(std::uint64_t index) const {
  for (const auto& frame : recording_.frames) {
    if (frame.index == index && frame.camera == 0) return frame.time;
  }
  return std::nullopt;
}

std::optional<Frame> Dataset::frameAt(std::uint64_t index) {
  for (const auto& frame : recording_.frames) {
    if (frame.index == index && frame.camera == 0) return decodeFrame(frame);
  }
  return std::nullopt;
}

std::optional<Message> Dataset::next() {
  while (true) {
    const bool has_imu = next_imu_ < recording_.imu.size();
    const bool has_speed = next_speed_ < recording_.speed.size();
    const bool has_frame = next_frame_ < recording_.frames.size();
    if (!has_imu && !has_speed && !has_frame) return std::nullopt;
    constexpr TimePoint kNever = TimePoint::max();
    const TimePoint imu = has_imu ? recording_.imu[next_imu_].time : kNever;
    const TimePoint speed = has_speed ? recording_.speed[next_speed_].time : kNever;
    const TimePoint frame = has_frame ? recording_.frames[next_frame_].time : kNever;
    if (has_imu && imu <= std::min(speed, frame)) return takeImu();
    if (has_speed && speed <= frame) {
      SpeedSample sample = recording_.speed[next_speed_++];
      sample.source = options_.source;
      return sample;
    }
    auto decoded = decodeFrame(recording_.frames[next_frame_++]);
    if (decoded) return *std::move(decoded);
  }
}

ImuSample Dataset::takeImu() {
  ImuSample sample = recording_.imu[next_imu_];
  sample.source = options_.source;
  if (next_imu_ > 0 && usual_interval_ > Duration{0}) {
    const Duration gap = between(sample.time, recording_.imu[next_imu_ - 1].time);
    if (multipleOf(2, gap) > multipleOf(7, usual_interval_)) {
      count({"imu_gap", "no inertial samples for " + std::to_string(toSeconds(gap)) + " s"});
    }
  }
  ++next_imu_;
  return sample;
}

std::optional<Frame> Dataset::decodeFrame(const Recording::FrameFile& file) {
  const CameraCalibration& camera = recording_.calibration.cameras[file.camera];
  Frame frame;
  frame.stamp.source = options_.source;
  frame.stamp.sequence = file.index;
  frame.stamp.time = file.time;
  frame.camera = camera.name;
  frame.width = camera.width;
  frame.height = camera.height;
  if ((file.path.empty() && !file.load) || !options_.decode) return frame;
  const auto encoding = file.camera == 0 ? options_.encoding : options_.second_encoding;
  const auto image = file.load ? recordedImage(file, encoding)
                               : vision::decodeImageFile(file.path, encoding, bitsOf(file));
  if (!image) {
    count(image.error());
    return std::nullopt;
  }
  const auto set = vision::setPixels(frame, *image);
  if (!set) {
    count({"image_corrupt", nameOf(file) + ": " + set.error().detail});
    return std::nullopt;
  }
  if (frame.width != camera.width || frame.height != camera.height) {
    count({"image_size", nameOf(file) + " is not of the calibration's size"});
    return std::nullopt;
  }
  return frame;
}

/// Returns the used bits of a camera's images: those of the brightest image in a sample over the
/// drive. One scale for all images prevents flicker.
int Dataset::bitsOf(const Recording::FrameFile& file) {
  const auto known = bits_.find(file.camera);
  if (known != bits_.end()) return known->second;
  int& bits = bits_[file.camera] = vision::usedBits(file.path);
  if (bits == 16) return bits;
  std::vector<const std::string*> paths;
  for (const auto& frame : recording_.frames) {
    if (frame.camera == file.camera) paths.push_back(&frame.path);
  }
  constexpr std::size_t kLooks = 5;
  for (std::size_t i = 0; i < kLooks; ++i) {
    bits = std::max(bits, vision::usedBits(*paths[i * (paths.size() - 1) / (kLooks - 1)]));
  }
  return bits;
}

void Dataset::count(const Reason& reason) {
  reasons_.add(reason);
  last_problem_ = reason.detail;
}

void Dataset::seek(std::uint64_t index) {
  const auto& frames = recording_.frames;
  next_frame_ = 0;
  while (next_frame_ < frames.size() && frames[next_frame_].index < index) ++next_frame_;
  const TimePoint from = next_frame_ == 0 ? TimePoint::min() : frames[next_frame_ - 1].time;
  const auto firstAfter = [from](const auto& samples) {
    const auto at = std::find_if(samples.begin(), samples.end(),
                                 [from](const auto& sample) { return sample.time > from; });
    return static_cast<std::size_t>(at - samples.begin());
  };
  next_imu_ = firstAfter(recording_.imu);
  next_speed_ = firstAfter(recording_.speed);
}

std::optional<std::uint64_t> Dataset::skip(Duration after) {
  std::optional<TimePoint> first;
  for (const auto& frame : recording_.frames) {
    if (frame.camera != 0) continue;
    if (!first) first = frame.time;
    if (between(frame.time, *first) < after) continue;
    seek(frame.index);
    return frame.index;
  }
  return std::nullopt;
}

}  // namespace perdure::replay
