// Frames in order of their stamps, each with its partner of the second camera, until somebody
// takes them.
#pragma once

#include <deque>
#include <optional>

#include "common/base/result.h"
#include "common/types/sensors.h"

namespace perdure::vio {

struct FramePair {
  Frame first;
  std::optional<Frame> second;
};

class WaitingFrames {
 public:
  explicit WaitingFrames(double pair_tolerance_s)
      : tolerance_(durationFromSeconds(pair_tolerance_s)) {}

  /// Of the first camera. Refuses "frame_duplicate"; "frame_reordered": it is in, before others;
  /// "frame_of_earlier_run": it is in, and those that are ahead of it by more than any transport
  /// reorders are given up.
  Result<void> addFirst(const Frame& frame);
  /// Of the second. "stereo_unpaired": the oldest one that found no partner has been given up.
  Result<void> addSecond(const Frame& frame);

  bool empty() const { return pairs_.empty(); }
  std::size_t size() const { return pairs_.size(); }
  const FramePair& front() const { return pairs_.front(); }
  FramePair take();
  /// The oldest one has no partner and one may still come: no later frame of either camera is here.
  bool frontMayBePaired() const;
  void clear();

 private:
  bool pair(const Frame& second);
  Duration tolerance_;
  std::deque<FramePair> pairs_;
  std::deque<Frame> seconds_;  ///< unpaired yet
};

}  // namespace perdure::vio
