// Queue of the first camera's frames in order of their stamps, each with its partner of the second
// camera.
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

  /// Adds a frame of the first camera. Refuses it with "frame_duplicate". It inserts the frame, but
  /// returns "frame_reordered" if later frames are waiting, and "frame_of_earlier_run" if it
  /// dropped frames that were farther ahead than transports reorder.
  Result<void> addFirst(const Frame& frame);
  /// Adds a frame of the second camera. Fails with "stereo_unpaired" if it dropped the oldest
  /// unpaired frame, and with "frame_late" if `frame` is not later than the last frame that was
  /// taken.
  Result<void> addSecond(const Frame& frame);
  /// Reports an unusable frame of the second camera; `why` is a sentence.
  void refuseSecond(std::string why) { trouble_ = std::move(why); }

  bool empty() const { return pairs_.empty(); }
  std::size_t size() const { return pairs_.size(); }
  const FramePair& front() const { return pairs_.front(); }
  FramePair take();
  /// Returns true if the oldest frame has no partner and may still receive one. Returns false if a
  /// later pair, three later frames, or a later frame of the second camera arrived. After ten
  /// frames without a partner it returns false until one arrives.
  bool frontMayBePaired() const;
  /// Returns a sentence with the fix if ten frames in a row found no partner; otherwise an empty
  /// string.
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
  std::string trouble_;             ///< problem of the second camera's last image, or empty
};

}  // namespace perdure::vio
