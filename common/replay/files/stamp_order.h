// Corrects the stamps of each sensor in a recording: their order, counters that wrapped, and clocks
// that were set. Readers deliver whole streams in the order of their files (orderByTime in
// recording.h); clock_check.h reports the result.
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "common/base/time.h"

namespace perdure::replay {

/// A place where the stamps of a sensor do not continue regularly.
struct ClockChange {
  enum class Kind {
    kCounter,  ///< a counter wrapped: `added` continues it exactly
    kSet,      ///< the clock was set: `added` continues it after a usual interval
    kPause,    ///< a pause, or a clock that was set forward; nothing is added
    kDigits,   ///< stamps are the digits of a time of day (HHMMSS); nothing is added
    kJoined    ///< seconds and nanoseconds were joined without leading zeros; nothing is added
  };
  Kind kind = Kind::kPause;
  /// Index of the first stamp after the change, in the order of the file.
  std::size_t index = 0;
  TimePoint before, after;   ///< the stamps on both sides, as written
  Duration added{0};         ///< offset that is added to `after` and all later stamps
  Duration usual{0};         ///< median interval of the sensor
  std::string counter = {};  ///< kCounter: "32 bits of µs", "a day"
  std::string sensor = {};   ///< "imu", "accel", "frame", "stereo", "speed", "truth"
  std::string place = {};    ///< "FILE:LINE", or the number of the message
  TimePoint continues = {};  ///< `after` in the corrected time
  bool common = false;  ///< the clocks of all sensors were set by the same amount; kDigits, kJoined
};

/// The stamps to keep, as indices in increasing order of their corrected times.
struct StampOrder {
  std::vector<std::size_t> kept;
  std::vector<TimePoint> times;  ///< times of all stamps, with corrected changes
  std::vector<ClockChange> changes;
  std::size_t moved = 0;   ///< number of stamps out of order, which were sorted
  std::size_t strays = 0;  ///< number of removed stamps that are few and far from their neighbours
  std::size_t repeated = 0;  ///< number of removed stamps that repeat another
};

/// Returns whether two samples, given by index, are equal apart from their stamps.
using AreSame = std::function<bool(std::size_t, std::size_t)>;

/// Orders the stamps of a sensor and corrects the changes of its clock. A step back, or a step of
/// over a day ahead, is a change of the clock if the stamps increase regularly on both sides. It is
/// not one if the stamps after it fill a gap before it (lines in another order) or repeat samples
/// before it. A counter that wrapped is recognised by its length. If the clock seems to be set more
/// than eight times, the list consists of overlapping batches, and no change is assumed. Stamps
/// that are digits, or were joined without zeros, are reported as a change and not corrected.
/// `known` has the changes of the recording's other sensors; by them a clock that was set back by a
/// few intervals is recognised.
///
/// Other stamps out of order are removed as strays if they are few, far outside their neighbours'
/// stamps, and do not fill a gap elsewhere. They are few if they are a fiftieth of all or at most
/// three, and if at most a fifth of all is out of order. Otherwise the list is sorted, and no stamp
/// is left out. Up to three stamps at either end are strays as well, if a pause longer than ten
/// seconds and a thousand usual intervals separates them.
StampOrder orderOf(
    const std::vector<TimePoint>& stamps, const AreSame& same = [](auto, auto) { return true; },
    const std::vector<ClockChange>& known = {});

}  // namespace perdure::replay
