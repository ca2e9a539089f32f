// Reads and decodes a drive in advance, on its own thread.
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

/// Opens the configured drive. Throws StartupError with the cause and the fix.
std::unique_ptr<replay::Dataset> openDrive(const Config& config, InstanceId source);

class Loader {
 public:
  /// Begins at frame `first`. `notify` is called on the loader's thread after each message. If
  /// run.on_end is "repeat", the drive repeats without end: frame n·frameCount() + i is frame i of
  /// the drive, later by n lap lengths (all frames and the interval between laps). Reading then
  /// begins one frame early, with the samples of that frame.
  Loader(const Config& config, std::unique_ptr<replay::Dataset> drive, std::uint64_t first,
         std::function<void()> notify);
  ~Loader();
  Loader(const Loader&) = delete;
  Loader& operator=(const Loader&) = delete;

  /// Returns the next message if it is ready; otherwise nothing. After the last message ended() is
  /// true.
  std::optional<replay::Message> take();
  bool ended() const;
  /// Return the counts of data problems (image_truncated, imu_gap, …), and the last problem as
  /// text.
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
  const int quality_;  ///< JPEG quality; 0: raw
  const bool repeats_;
  std::unique_ptr<replay::Dataset> drive_;
  TimePoint from_, until_;  ///< interval of the samples, until_ excluded
  TimePoint begin_;         ///< time of the first frame
  Duration length_{0};      ///< length of a lap
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
