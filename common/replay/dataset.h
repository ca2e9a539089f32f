// Dataset folders and recordings played as messages: EuRoC ASL, KITTI raw, KITTI tracking,
// 7-Scenes, what perdure record left, and recordings of ROS, known by looking. Samples and frames
// are merged by time, always in the same order; images are decoded when asked.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "common/base/result.h"
#include "common/replay/files/pose_file.h"
#include "common/types/sensors.h"

namespace perdure::replay {

using Message = std::variant<ImuSample, SpeedSample, Frame>;

struct DatasetOptions {
  std::filesystem::path path = {};
  std::string sequence = {};  ///< of KITTI tracking, and of a 7-Scenes folder with several
  /// Width and height, tracking without images.
  std::optional<std::pair<std::uint32_t, std::uint32_t>> image_size = {};
  std::optional<std::size_t> frame_count = {};  ///< tracking without images and labels: how many
  InstanceId source = 1;                        ///< of the messages
  std::optional<ImageEncoding> encoding = {};   ///< of cam0; as the files are where not given
  std::optional<ImageEncoding> second_encoding = {};  ///< of cam1
  std::filesystem::path rig = {};  ///< rig file instead of the drive's own calibration
  std::size_t every = 1;           ///< each N-th frame of cam0 alone, with its partner
  bool decode = true;              ///< false: frames carry stamp and size, but no pixels
  /// Of a recording of ROS: topics by cam0, cam1, imu, where types and names do not tell.
  std::map<std::string, std::string> topics = {};
};

enum class DatasetKind {
  kEuroc,
  kKittiRaw,
  kKittiTracking,
  kSevenScenes,
  kRecording,
  kRosRecording
};

/// What a reader found in a folder.
struct Recording {
  struct FrameFile {
    TimePoint time;
    std::uint64_t index = 0;  ///< in the dataset, from 0; both cameras of a pair share it
    std::size_t camera = 0;   ///< index into calibration.cameras
    std::string path;         ///< empty: a frame without pixels, or one that `load` gives
    std::function<Result<Frame>()> load = {};  ///< of a recording; reasons image_…
  };
  DatasetKind kind = DatasetKind::kEuroc;
  Calibration calibration;
  std::size_t frame_count = 0;
  std::vector<FrameFile> frames;         ///< by time, cameras in order
  std::vector<TimePoint> unpaired = {};  ///< of cam1's frames that none of cam0 is near to
  std::vector<ImuSample> imu;            ///< by time
  std::vector<SpeedSample> speed;
  /// Of the body, in a world whose z is up. Of a KITTI drive: by OXTS, east, north and up.
  std::optional<PoseFile> truth;
  ReasonCounts reasons;  ///< what was left out while reading
  std::vector<std::string> notes =
      {};  ///< for people: what was mended or is not known, a sentence each
};

class Dataset {
 public:
  /// Throws StartupError with the mend: kUnavailable where something is missing, kData where a file
  /// cannot be used as it is.
  static std::unique_ptr<Dataset> open(const DatasetOptions& options);
  Dataset(const DatasetOptions& options, Recording recording);

  DatasetKind kind() const { return recording_.kind; }
  const Calibration& calibration() const { return recording_.calibration; }
  /// Frames of cam0 in the dataset, those that turn out unreadable included.
  std::size_t frameCount() const { return recording_.frame_count; }
  /// Capture time of frame `index` of cam0; nothing where the dataset has no such frame.
  std::optional<TimePoint> frameTime(std::uint64_t index) const;
  /// Frame `index` of cam0 with its pixels, out of turn; nothing where there is none, or where its
  /// image is missing or wrong (counted as by next()).
  std::optional<Frame> frameAt(std::uint64_t index);
  const std::optional<PoseFile>& truth() const { return recording_.truth; }
  /// All that was found: frames without their pixels, samples, notes.
  const Recording& recording() const { return recording_; }

  /// The next message, or nothing at the end. Frames that cannot be decoded are counted
  /// (image_missing, image_truncated, image_corrupt, image_size) and left out; their index is
  /// not given again. At equal times: imu, speed, cam0, cam1.
  std::optional<Message> next();
  /// Counted so far; imu_gap (more than 3.5 usual intervals) when the sample after it is given.
  const ReasonCounts& reasons() const { return reasons_; }
  /// The last thing that was counted, for people.
  const std::string& lastProblem() const { return last_problem_; }
  /// Continues at frame `index` with the samples that follow the frame before it.
  void seek(std::uint64_t index);
  /// seek() to the first frame of cam0 that comes `after` the first one by so much, and its index;
  /// nothing where there is none.
  std::optional<std::uint64_t> skip(Duration after);

 private:
  std::optional<Frame> decodeFrame(const Recording::FrameFile& file);
  int bitsOf(const Recording::FrameFile& file);
  ImuSample takeImu();
  void count(const Reason& reason);

  DatasetOptions options_;
  Recording recording_;
  Duration usual_interval_{0};
  std::map<std::size_t, int> bits_;  ///< that images of 16 bits use, by camera
  std::size_t next_imu_ = 0, next_speed_ = 0, next_frame_ = 0;
  ReasonCounts reasons_;
  std::string last_problem_;
};

}  // namespace perdure::replay
