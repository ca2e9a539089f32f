// Position of a GNSS receiver's antenna, as the receiver reports it.
#pragma once

#include <cstdint>
#include <optional>

namespace perdure::capture {

struct GnssFix {
  std::int64_t time_ns = 0;                                  ///< CLOCK_BOOTTIME
  double latitude_deg = 0, longitude_deg = 0, height_m = 0;  ///< WGS 84, above the ellipsoid
  double sigma_m = 0;            ///< standard deviation of each horizontal axis
  std::optional<double> speed;   ///< m/s over ground
  std::optional<double> course;  ///< radians from east, counter-clockwise, (−π, π]
};

}  // namespace perdure::capture
