// One reading of how fast the vehicle is.
#pragma once

#include <cstdint>
#include <string>

#include "common/base/result.h"

namespace perdure::capture {

struct SpeedReading {
  std::int64_t time_ns = 0;  ///< CLOCK_BOOTTIME
  double speed = 0.0;        ///< m/s along the body's x axis; backwards below 0
  double sigma = 0.0;        ///< m/s, one deviation
};

/// What a unit is in m/s: m/s, km/h, mph, kn and their usual other names. Reason "speed_unit".
Result<double> metresPerSecond(const std::string& unit);

}  // namespace perdure::capture
