// Stamps of a recording as people have them: spelled in several ways, out of order, and single ones
// far from where their neighbours are.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/time.h"

namespace perdure::replay {

/// Whole nanoseconds, ≥ 0: "1403636579763555584", with a point and zeros behind it, or as
/// numpy.savetxt has it ("1.403636579763555584e+18"), exactly. Nothing where a fraction is left.
std::optional<TimePoint> parseNanoseconds(std::string_view text);

/// Why parseNanoseconds() gave nothing, and the mend; "" where it gave something.
std::string whyNoStamp(std::string_view text);

/// a − b. A file may state any stamps: where they are farther apart than 292 years, that.
Duration between(TimePoint a, TimePoint b);
/// n · d, at most that, too.
Duration multipleOf(std::int64_t n, Duration d);

/// Which stamps are kept, as indices, so that they increase.
struct StampOrder {
  std::vector<std::size_t> kept;
  std::size_t moved = 0;     ///< did not stand in order and were sorted
  std::size_t strays = 0;    ///< left out: a few whose stamp is far from their neighbours'
  std::size_t repeated = 0;  ///< left out: the stamp was there before
};

/// Stamps that increase are all kept. Else those that are out of line are strays where they are few
/// (a fiftieth, or three, where a fifth at most is out of line) and far outside of their
/// neighbours' stamps, and fill no hole elsewhere; with more of them the list was not sorted, and
/// nothing is left out. Also strays: up to three stamps before the first or behind the last of the
/// others, with a pause that is longer than ten seconds and a thousand usual intervals.
StampOrder orderOf(const std::vector<TimePoint>& stamps);

}  // namespace perdure::replay
