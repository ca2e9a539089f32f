// Parses the stamps of recordings, in several notations. Their order is checked by
// files/stamp_order.h.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "common/base/time.h"

namespace perdure::replay {

/// Parses whole nanoseconds, ≥ 0, exactly: "1403636579763555584", also with a decimal point and
/// zeros, or in the format of numpy.savetxt ("1.403636579763555584e+18"). Returns nothing if a
/// fraction remains.
std::optional<TimePoint> parseNanoseconds(std::string_view text);

/// Parses seconds exactly to the nanosecond; a double resolves only 0.2 µs of a Unix time.
std::optional<TimePoint> parseSeconds(std::string_view text);

/// Returns the reason and the fix if parseNanoseconds() returns nothing. Otherwise returns "".
std::string whyNoStamp(std::string_view text);

/// Returns the reason and the fix if the text has the digits of a date and a time of day with a
/// fraction (YYYYMMDDHHMMSSmmm, YYMMDDHHMMSSmmm, or with more decimals). Otherwise returns "". Some
/// stamps in nanoseconds have such digits, too.
std::string whyDateDigits(std::string_view text);

/// a − b, limited to ±292 years, because a file may contain any stamps.
Duration between(TimePoint a, TimePoint b);
/// n · d, limited to ±292 years.
Duration multipleOf(std::int64_t n, Duration d);

}  // namespace perdure::replay
