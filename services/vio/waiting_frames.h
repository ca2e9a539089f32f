// Queue of frames in order of their stamps, each with its partner of the second camera.
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

  /// Adds a frame of the first camera. Refuses it with "frame_duplicate". With "frame_reordered" it
  /// is inserted before others. With "frame_of_earlier_run" it is inserted, and frames that are
  /// further ahead than transports reorder are dropped.
  Result<void> addFirst(const Frame& frame);
  /// Adds a frame of the second camera. Fails with "stereo_unpaired" if the oldest unpaired frame
  /// was dropped, and with "frame_late" if its pair was already taken.
  Result<void> addSecond(const Frame& frame);
  /// Reports an unusable frame of the second camera; why: a sentence.
  void refuseSecond(std::string why) { trouble_ = std::move(why); }

  bool empty() const { return pairs_.empty(); }
  std::size_t size() const { return pairs_.size(); }
  const FramePair& front() const { return pairs_.front(); }
  FramePair take();
  /// Whether the oldest frame has no partner and may still receive one. False if a later frame of
  /// either camera has arrived. Also false after many frames without a partner, until one arrives.
  bool frontMayBePaired() const;
  /// One sentence with the fix if several frames in a row found no partner; otherwise empty.
  std::string whyAlone() const;
  void clear();

 private:
  bool pair(const Frame& second);
  bool isLate(const Frame& second);
  Duration tolerance_;
  std::deque<FramePair> pairs_;
  std::deque<Frame> seconds_;       ///< frames of the second camera without a partner yet
  std::optional<TimePoint> taken_;  ///< stamp of the last frame taken
  int alone_ = 0;                   ///< frames taken in a row without a partner
  std::deque<TimePoint> missed_;    ///< stamps of frames without a partner, since the last pair
  std::string trouble_;             ///< problem of the second camera's last image; empty: none
};

}  // namespace perdure::vio
