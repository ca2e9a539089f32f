// Gives the second camera's images the stamps of the first's: both of a pair are one frame.
#pragma once

#include <chrono>
#include <deque>
#include <optional>
#include <vector>

#include "common/types/sensors.h"

namespace perdure::ros2 {

class Stereo {
 public:
  static constexpr Duration kTolerance = std::chrono::milliseconds(10);  ///< vio's, too

  /// A frame of the first camera went out; those of the second that waited for it.
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
  /// A frame of the second, stamped by its own time: with its pair's stamp, where that is there.
  std::optional<Frame> onSecond(Frame frame) {
    for (const FrameStamp& first : firsts_) {
      if (std::chrono::abs(frame.stamp.time - first.time) > kTolerance) continue;
      frame.stamp = first;
      return frame;
    }
    waiting_.push_back(std::move(frame));
    return std::nullopt;
  }
  /// Whether one that waited had to give up.
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
