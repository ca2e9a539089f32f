// Frames in order of their stamps, each with its partner of the second camera, until somebody
// takes them.
#pragma once

#include <deque>
#include <optional>
#include <string>

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
  /// Of the second. "stereo_unpaired": the oldest one that found no partner has been given up;
  /// "frame_late": its time is over.
  Result<void> addSecond(const Frame& frame);
  /// One of the second that could not be used; why: a sentence.
  void refuseSecond(std::string why) { trouble_ = std::move(why); }

  bool empty() const { return pairs_.empty(); }
  std::size_t size() const { return pairs_.size(); }
  const FramePair& front() const { return pairs_.front(); }
  FramePair take();
  /// The oldest one has no partner and one may still come: no later frame of either camera is here,
  /// and not so many were taken alone that none is awaited until one comes.
  bool frontMayBePaired() const;
  /// One sentence with the mend where some frames in a row found no partner; else empty.
  std::string whyAlone() const;
  void clear();

 private:
  bool pair(const Frame& second);
  bool isLate(const Frame& second);
  Duration tolerance_;
  std::deque<FramePair> pairs_;
  std::deque<Frame> seconds_;       ///< unpaired yet
  std::optional<TimePoint> taken_;  ///< the last one
  int alone_ = 0;                   ///< taken in a row
  std::deque<TimePoint> missed_;    ///< of these, since an image of the second camera came for one
  std::string trouble_;  ///< of the second camera's last image; empty: all is well, or none
};

}  // namespace perdure::vio
