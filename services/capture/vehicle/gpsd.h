// Reads reports of gpsd, one JSON object per line. Source: gpsd_json(5), protocol 3.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "common/base/result.h"

namespace perdure::capture {

struct GnssFix {
  std::int64_t time_ns = 0;                                  ///< CLOCK_BOOTTIME
  double latitude_deg = 0, longitude_deg = 0, height_m = 0;  ///< WGS 84, above the ellipsoid
  double sigma_m = 0;            ///< standard deviation of each horizontal axis
  std::optional<double> speed;   ///< m/s over ground
  std::optional<double> course;  ///< radians from east, counter-clockwise, (−π, π]
};

/// The request that starts gpsd's reports. It is sent once per connection.
inline constexpr std::string_view kGpsdWatch = "?WATCH={\"enable\":true,\"json\":true};\n";

/// Returns the fix of a TPV report; nothing for other reports. The height is altHAE, or alt before
/// protocol 3.14. Fails with "gpsd_malformed", or with "gpsd_no_fix" if gpsd reports no
/// three-dimensional fix.
Result<std::optional<GnssFix>> readGpsd(std::string_view line, std::int64_t time_ns);

}  // namespace perdure::capture
