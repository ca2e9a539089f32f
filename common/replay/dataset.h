// Plays dataset folders and recordings as messages: EuRoC ASL, KITTI raw, KITTI tracking, 7-Scenes,
// recordings of phones, of `perdure record`, and of ROS. The format is detected automatically.
// Samples and frames are merged by time in a fixed order; images are decoded on request.
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
#include "common/replay/files/stamp_order.h"
#include "common/types/sensors.h"

namespace perdure::replay {

using Message = std::variant<ImuSample, SpeedSample, Frame>;

struct DatasetOptions {
  std::filesystem::path path = {};
  std::string sequence = {};  ///< name of the sequence, for KITTI tracking and 7-Scenes
  /// Width and height, for KITTI tracking without images.
  std::optional<std::pair<std::uint32_t, std::uint32_t>> image_size = {};
  std::optional<std::size_t> frame_count = {};        ///< number of frames, for KITTI tracking
  InstanceId source = 1;                              ///< source id of the messages
  std::optional<ImageEncoding> encoding = {};         ///< encoding of cam0; default: as in the
                                                      ///< files
  std::optional<ImageEncoding> second_encoding = {};  ///< encoding of cam1
  std::filesystem::path rig = {};  ///< rig file that replaces the drive's own calibration
  std::size_t every = 1;           ///< use only each N-th frame of cam0, with its partner
  bool decode = true;              ///< false: frames have stamp and size, but no pixels
  /// Accepts a phone's recording without lens or camera pose, in order to find them. Unknown
  /// cameras have a focal length of 0.
  bool uncalibrated = false;
  /// Topics of a ROS recording by cam0, cam1 and imu. Required if types and names do not identify
  /// them.
  std::map<std::string, std::string> topics = {};
};

enum class DatasetKind {
  kEuroc,
  kKittiRaw,
  kKittiTracking,
  kSevenScenes,
  kPhone,
  kRecording,
  kRosRecording
};

/// The contents of a folder, as found by a reader.
struct Recording {
  struct FrameFile {
    TimePoint time;
    std::uint64_t index = 0;  ///< frame index, from 0; shared by both cameras of a pair
    std::size_t camera = 0;   ///< index into calibration.cameras
    std::string path;  ///< path of the image; empty if it has no pixels or if `load` reads them
    std::function<Result<Frame>()> load =
        {};  ///< reads the frame from a recording; its reasons begin with image_
  };
  DatasetKind kind = DatasetKind::kEuroc;
  Calibration calibration;
  std::size_t frame_count = 0;
  std::vector<FrameFile> frames;  ///< sorted by time, then by camera
  /// Numbers of all frames of cam0, including those that --every leaves out. The key is the name of
  /// the image without its ending, or the stamp if the image has no name.
  std::map<std::string, std::uint64_t> numbers = {};
  std::vector<TimePoint> unpaired = {};  ///< frames of cam1 without a frame of cam0 nearby
  std::vector<ImuSample> imu;            ///< sorted by time
  std::vector<SpeedSample> speed;
  /// True poses of the body, in a world whose z points up. For KITTI drives they come from OXTS:
  /// east, north and up.
  std::optional<PoseFile> truth;
  std::vector<ClockChange> clock_changes = {};
  ReasonCounts reasons;  ///< counts of data left out while reading
  std::vector<std::string> notes =
      {};  ///< for users: one sentence for each repaired or unknown item
};

class Dataset {
 public:
  /// Throws StartupError with the fix: kUnavailable if something is missing, kData if a file cannot
  /// be used as it is.
  static std::unique_ptr<Dataset> open(const DatasetOptions& options);
  Dataset(const DatasetOptions& options, Recording recording);

  DatasetKind kind() const { return recording_.kind; }
  const Calibration& calibration() const { return recording_.calibration; }
  /// Number of frames of cam0 in the dataset, including unreadable ones.
  std::size_t frameCount() const { return recording_.frame_count; }
  /// Capture time of frame `index` of cam0. Returns nothing if the dataset has no such frame.
  std::optional<TimePoint> frameTime(std::uint64_t index) const;
  /// Frame `index` of cam0 with its pixels, independent of next(). Returns nothing if it does not
  /// exist, or if its image is missing or invalid (counted as by next()).
  std::optional<Frame> frameAt(std::uint64_t index);
  const std::optional<PoseFile>& truth() const { return recording_.truth; }
  /// The complete contents: frames without their pixels, samples, notes.
  const Recording& recording() const { return recording_; }

  /// The next message, or nothing at the end. Frames that cannot be decoded are counted
  /// (image_missing, image_truncated, image_corrupt, image_size) and skipped; their index is not
  /// reused. At equal times the order is imu, speed, cam0, cam1.
  std::optional<Message> next();
  /// Returns the counts so far. An imu_gap (more than 3.5 usual intervals) is counted with the
  /// sample after the gap.
  const ReasonCounts& reasons() const { return reasons_; }
  /// The problem counted last, as text for users.
  const std::string& lastProblem() const { return last_problem_; }
  /// Makes next() continue with the samples after the previous frame, and then frame `index`.
  void seek(std::uint64_t index);
  /// Calls seek() for the first frame of cam0 that is at least `after` later than the first one,
  /// and returns its index. Returns nothing if there is none.
  std::optional<std::uint64_t> skip(Duration after);

 private:
  std::optional<Frame> decodeFrame(const Recording::FrameFile& file);
  int bitsOf(const Recording::FrameFile& file);
  ImuSample takeImu();
  void count(const Reason& reason);

  DatasetOptions options_;
  Recording recording_;
  Duration usual_interval_{0};
  std::map<std::size_t, int> bits_;  ///< used bits of 16-bit images, by camera
  std::size_t next_imu_ = 0, next_speed_ = 0, next_frame_ = 0;
  ReasonCounts reasons_;
  std::string last_problem_;
};

}  // namespace perdure::replay
