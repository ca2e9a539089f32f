// Stamps of recordings in practice: in several notations, out of order, and with outliers far from
// their neighbours.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/time.h"

namespace perdure::replay {

/// Parses whole nanoseconds, ≥ 0, exactly: "1403636579763555584", also with a decimal point and
/// zeros, or in the format of numpy.savetxt ("1.403636579763555584e+18"). Returns nothing if a
/// fraction remains.
std::optional<TimePoint> parseNanoseconds(std::string_view text);

/// The reason and the fix if parseNanoseconds() returns nothing. Otherwise returns "".
std::string whyNoStamp(std::string_view text);

/// a − b, limited to ±292 years, because a file may contain any stamps.
Duration between(TimePoint a, TimePoint b);
/// n · d, with the same limit.
Duration multipleOf(std::int64_t n, Duration d);

/// The stamps to keep, as indices in increasing order of the stamps.
struct StampOrder {
  std::vector<std::size_t> kept;
  std::size_t moved = 0;     ///< out of order; sorted
  std::size_t strays = 0;    ///< removed: a few stamps far from their neighbours
  std::size_t repeated = 0;  ///< removed: repeated stamps
};

/// Increasing stamps are all kept. Otherwise the stamps out of order are examined. They are strays
/// if they are few and far outside their neighbours' stamps, and do not fill a gap elsewhere. Few
/// means a fiftieth or three, if at most a fifth is out of order. With more of them the list is
/// treated as unsorted, and no stamp is left out.
/// Up to three stamps at either end are strays as well, if they are separated by a pause longer
/// than ten seconds and a thousand usual intervals.
StampOrder orderOf(const std::vector<TimePoint>& stamps);

}  // namespace perdure::replay
