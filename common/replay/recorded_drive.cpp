// Recordings of `perdure record` as a dataset: sensors, calibration, and images if they were
// recorded. Images are decoded on request.
#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <tuple>
#include <utility>

#include "common/base/errors.h"
#include "common/replay/files/text_file.h"
#include "common/replay/recording.h"
#include "common/replay/recordings/recorded_messages.h"

namespace perdure::replay {
namespace {

constexpr std::string_view kFramePrefix = "frame/";

/// Reference to one image in the recording; its pixels are read on request.
struct Seen {
  TimePoint time;    ///< corrected (files/stamp_order.h)
  FrameStamp stamp;  ///< stamp as recorded
  std::string camera;
  std::uint64_t log_ns = 0;
};

/// Reads images quickly in the order of the recording. Any other order requires a rewind.
class Images {
 public:
  explicit Images(const std::filesystem::path& path) : messages_(path) { rewind(0); }

  Result<Frame> at(const Seen& wanted) {
    if (last_ && last_->log_ns > wanted.log_ns) rewind(wanted.log_ns);
    while (true) {
      if (!last_ || last_->log_ns < wanted.log_ns) last_ = messages_.next();
      if (!last_ || last_->log_ns > wanted.log_ns) break;
      if (last_->topic == std::string(kFramePrefix) + wanted.camera) {
        auto frame = valueOf<Frame>(*last_);
        if (frame && frame->stamp.sameFrame(wanted.stamp)) return frame;
      }
      last_ = messages_.next();
    }
    return fail("image_missing", wanted.camera + " has no frame " +
                                     std::to_string(wanted.stamp.sequence) + " in the recording");
  }

 private:
  void rewind(std::uint64_t from_ns) {
    messages_.rewind([](const std::string& topic) { return topic.starts_with(kFramePrefix); },
                     from_ns);
    last_.reset();
  }

  RecordedMessages messages_;
  std::optional<RecordedMessage> last_;
};

class DriveReader {
 public:
  explicit DriveReader(const std::filesystem::path& path) : path_(path), messages_(path) {}

  Recording read() {
    messages_.rewind([](const std::string& topic) {
      return topic == "imu" || topic == "speed" || topic == "calibration" || topic == "odometry" ||
             topic.starts_with(kFramePrefix);
    });
    while (const auto message = messages_.next()) take(*message);
    recording_.reasons.add(messages_.reasons());
    if (recording_.calibration.cameras.empty()) {
      refuseStrangers();
      const std::string& problem = messages_.lastProblem();
      throwMissing(path_, "the calibration in the recording",
                   problem.empty() ? "record while capture runs: it gives one" : problem);
    }
    orderSamples();
    recording_.kind = DatasetKind::kRecording;
    for (auto& note : messages_.notes()) recording_.notes.push_back(std::move(note));
    recording_.calibration.has_speed = !recording_.speed.empty();
    if (images_.empty()) images_ = std::move(looks_);
    addFrames();
    return std::move(recording_);
  }

 private:
  /// Refuses a recording whose messages are neither Perdure's nor ROS's. MCAP can contain protobuf
  /// or JSON, for example.
  void refuseStrangers() const {
    for (const auto& [name, topic] : messages_.topics()) {
      if (topic.schema_encoding == "omgidl") continue;
      const bool same = topic.schema_encoding == topic.encoding;
      throw StartupError(
          ExitCode::kData,
          path_.string() + ": the messages on " + name + " are " + topic.type + " in `" +
              topic.encoding + (same ? "" : "` with a schema in `" + topic.schema_encoding) +
              "`, which is not read; record messages of ROS 1 or 2, or use perdure record");
    }
  }

  template <class T>
  std::optional<T> valueIn(const RecordedMessage& message) {
    auto value = valueOf<T>(message);
    if (value) return *std::move(value);
    recording_.reasons.add(message.topic + "_malformed");
    return std::nullopt;
  }

  void take(const RecordedMessage& message) {
    if (message.topic == "calibration") {
      if (auto value = valueIn<Calibration>(message)) recording_.calibration = *std::move(value);
    } else if (message.topic == "imu") {
      if (const auto value = valueIn<ImuSample>(message)) recording_.imu.push_back(*value);
    } else if (message.topic == "speed") {
      if (const auto value = valueIn<SpeedSample>(message)) recording_.speed.push_back(*value);
    } else if (message.topic == "odometry") {
      if (const auto value = valueIn<Odometry>(message)) {
        looks_.push_back({value->stamp.time, value->stamp, {}, message.log_ns});
      }
    } else if (const auto value = valueIn<Frame>(message)) {
      images_.push_back({value->stamp.time, value->stamp, value->camera, message.log_ns});
    }
  }

  void orderSamples() {
    orderImu(recording_, "imu");
    orderByTime(recording_.speed, "speed", "speed", recording_);
    for (std::size_t i = 0; i < recording_.speed.size(); ++i) recording_.speed[i].sequence = i;
  }

  /// Index of the camera in the calibration. Returns nothing if the calibration has no camera of
  /// this name.
  std::optional<std::size_t> cameraOf(const Seen& seen) const {
    const auto& cameras = recording_.calibration.cameras;
    for (std::size_t i = 0; i < cameras.size(); ++i) {
      if (cameras[i].name == seen.camera || (seen.camera.empty() && i == 0)) return i;
    }
    return std::nullopt;
  }

  void addFrames() {
    std::map<std::pair<InstanceId, std::uint64_t>, Recording::FrameFile> first;
    const auto store = std::make_shared<Images>(path_);
    for (const std::size_t wanted : {0u, 1u}) {
      std::vector<Seen> images;
      std::copy_if(images_.begin(), images_.end(), std::back_inserter(images),
                   [&](const Seen& seen) { return cameraOf(seen) == wanted; });
      orderByTime(images, wanted == 0 ? "frame" : "stereo", fmt::format("frame/cam{}", wanted),
                  recording_);
      for (const Seen& seen : images) {
        Recording::FrameFile file{seen.time, recording_.frame_count, wanted, {}};
        if (!seen.camera.empty()) file.load = [store, seen] { return store->at(seen); };
        const std::pair identity(seen.stamp.source, seen.stamp.sequence);
        if (wanted == 0) {
          if (!first.emplace(identity, file).second)
            continue;  // the recorder received the image twice
          ++recording_.frame_count;
        } else {
          const auto pair = first.find(identity);
          if (pair == first.end()) {
            recording_.reasons.add("stereo_unmatched");
            continue;
          }
          file.index = pair->second.index;
          file.time = pair->second.time;
        }
        recording_.frames.push_back(std::move(file));
      }
    }
    sortFrames(recording_);
  }

  std::filesystem::path path_;
  RecordedMessages messages_;
  Recording recording_;
  std::vector<Seen> images_, looks_;
};

}  // namespace

Recording readRecordedDrive(const DatasetOptions& options) {
  return DriveReader(options.path).read();
}

}  // namespace perdure::replay
