// Gives images of the second camera the stamp of the matching image of the first: a pair is one
// frame.
#pragma once

#include <chrono>
#include <deque>
#include <optional>
#include <vector>

#include "common/types/sensors.h"

namespace perdure::ros2 {

class Stereo {
 public:
  /// Equals vio's tolerance for pairs.
  static constexpr Duration kTolerance = std::chrono::milliseconds(10);

  /// Adds a frame of the first camera, and returns the waiting frames of the second that match it.
  std::vector<Frame> onFirst(const FrameStamp& stamp) {
    firsts_.push_back(stamp);
    if (firsts_.size() > kKept) firsts_.pop_front();
    std::vector<Frame> paired;
    std::erase_if(waiting_, [&](Frame& second) {
      if (std::chrono::abs(second.stamp.time - stamp.time) > kTolerance) return false;
      second.stamp = stamp;
      paired.push_back(std::move(second));
      return true;
    });
    return paired;
  }
  /// Adds a frame of the second camera. Returns it with the stamp of the first camera's matching
  /// frame if that has arrived; otherwise the frame waits.
  std::optional<Frame> onSecond(Frame frame) {
    for (const FrameStamp& first : firsts_) {
      if (std::chrono::abs(frame.stamp.time - first.time) > kTolerance) continue;
      frame.stamp = first;
      return frame;
    }
    waiting_.push_back(std::move(frame));
    return std::nullopt;
  }
  /// Drops the oldest waiting frame if too many wait, and returns whether it did.
  bool overflowed() {
    if (waiting_.size() <= kKept) return false;
    waiting_.pop_front();
    return true;
  }

 private:
  static constexpr std::size_t kKept = 4;
  std::deque<FrameStamp> firsts_;
  std::deque<Frame> waiting_;
};

}  // namespace perdure::ros2
