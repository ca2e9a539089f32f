// Reads and decodes a drive ahead of its pacing, on a thread of its own.
#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "common/base/bounded_queue.h"
#include "common/replay/dataset.h"
#include "services/capture/config.h"

namespace perdure::capture {

/// Opens the configured drive. Throws StartupError: what is missing, and the mend.
std::unique_ptr<replay::Dataset> openDrive(const Config& config, InstanceId source);

class Loader {
 public:
  /// From frame `first` on. `notify` is called on the loader's thread after each message. With
  /// run.on_end "repeat" the drive has no end: frame n·frameCount() + i is its frame i, later by n
  /// times its length (of all frames and the pause between two); it then begins one frame early,
  /// with the samples that go with that one.
  Loader(const Config& config, std::unique_ptr<replay::Dataset> drive, std::uint64_t first,
         std::function<void()> notify);
  ~Loader();
  Loader(const Loader&) = delete;
  Loader& operator=(const Loader&) = delete;

  /// The next message if it is ready; ended() tells whether there will be more.
  std::optional<replay::Message> take();
  bool ended() const;
  /// What was left out so far (image_truncated, imu_gap, …), and the last problem for people.
  ReasonCounts reasons() const;
  std::string lastProblem() const;

 private:
  void run();
  void finish();
  bool isOver(const std::optional<replay::Message>& message) const;
  bool isWanted(const replay::Message& message) const;
  void moveToLap(replay::Message& message) const;
  void compress(replay::Message& message);

  const bool mono_;
  const int quality_;  ///< of JPEG; 0: raw
  const bool repeats_;
  std::unique_ptr<replay::Dataset> drive_;
  TimePoint from_, until_;  ///< of the samples, the latter excluded
  TimePoint begin_;         ///< of the first frame
  Duration length_{0};      ///< of a lap
  const std::uint64_t frame_count_;
  std::uint64_t lap_ = 0;
  std::function<void()> notify_;
  BoundedQueue<replay::Message> queue_{16, Overflow::kBlock};
  mutable std::mutex mutex_;
  ReasonCounts reasons_, uncompressed_;
  std::string last_problem_;
  bool ended_ = false;
  std::thread thread_;
};

}  // namespace perdure::capture
