// Position of a GNSS receiver's antenna, as the receiver reports it.
#pragma once

#include <cmath>
#include <cstdint>
#include <optional>

namespace perdure::capture {

struct GnssFix {
  std::int64_t time_ns = 0;                                  ///< CLOCK_BOOTTIME
  double latitude_deg = 0, longitude_deg = 0, height_m = 0;  ///< WGS 84, above the ellipsoid
  double sigma_m = 0;           ///< standard deviation of each horizontal axis
  std::optional<double> speed;  ///< m/s over ground
  std::optional<double> course;  ///< course over ground: radians from east, counter-clockwise, (−π,
                                 ///< π]
};

/// Whether a height is plausible, including heights in the air and below the sea.
inline bool isHeight(double metres) { return std::abs(metres) <= 1e5; }
/// Whether a course is valid, in degrees clockwise from north.
inline bool isCourse(double degrees) { return degrees >= 0.0 && degrees <= 360.0; }

/// Converts degrees clockwise from north to radians counter-clockwise from east, (−π, π].
double courseOf(double degrees_from_north);

}  // namespace perdure::capture
