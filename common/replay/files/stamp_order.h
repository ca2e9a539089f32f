// Decides about the stamps of each sensor in a recording: their order, counters that wrapped,
// and clocks that were set. Readers deliver whole streams in the order of their files (orderByTime
// in recording.h); clock_check.h judges the result.
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "common/base/time.h"

namespace perdure::replay {

/// A place where the stamps of a sensor do not go on.
struct ClockChange {
  enum class Kind {
    kCounter,  ///< a counter wrapped: `added` continues it exactly
    kSet,      ///< the clock was set: `added` continues it after a usual interval
    kPause     ///< a pause, or a clock that was set forward; nothing is added
  };
  Kind kind = Kind::kPause;
  /// Index of the first stamp after the change, in the order of the file.
  std::size_t index = 0;
  TimePoint before, after;   ///< the stamps on both sides, as written
  Duration added{0};         ///< offset that is added to `after` and all later stamps
  Duration usual{0};         ///< median interval of the sensor
  std::string counter = {};  ///< kCounter: "32 bits of µs", "a day"
  std::string sensor = {};   ///< "imu", "frame", "stereo", "speed", "truth"
  std::string place = {};    ///< "FILE:LINE", or the number of the message
  TimePoint continues = {};  ///< `after` in the corrected time
  bool common = false;       ///< kSet: all sensors changed alike
};

/// The stamps to keep, as indices in increasing order of their corrected times.
struct StampOrder {
  std::vector<std::size_t> kept;
  std::vector<TimePoint> times;  ///< times of all stamps, continued over the changes
  std::vector<ClockChange> changes;
  std::size_t moved = 0;     ///< out of order; sorted
  std::size_t strays = 0;    ///< removed: a few stamps far from their neighbours
  std::size_t repeated = 0;  ///< removed: repeated stamps
};

/// Whether two samples of a sensor are equal apart from their stamps.
using AreSame = std::function<bool(std::size_t, std::size_t)>;

/// Increasing stamps are all kept. A step back, or one of over a day ahead, between stamps that
/// increase regularly on both sides is a change of the clock, unless the stamps behind it fill a
/// gap before it (lines in another order) or repeat samples before it. A counter is recognised by
/// its length. More than eight clocks that were set are none: batches overlap. A clock that was set
/// back by a few intervals is recognised by `known`, the changes that the recording's other sensors
/// show.
///
/// Other stamps out of order are strays if they are few, far outside their neighbours' stamps, and
/// do not fill a gap elsewhere. Few means a fiftieth or three, if at most a fifth is out of order.
/// With more of them the list is unsorted, and no stamp is left out. Up to three stamps at either
/// end are strays as well, if they are separated by a pause longer than ten seconds and a thousand
/// usual intervals.
StampOrder orderOf(
    const std::vector<TimePoint>& stamps, const AreSame& same = [](auto, auto) { return true; },
    const std::vector<ClockChange>& known = {});

}  // namespace perdure::replay
