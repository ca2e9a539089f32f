// One reading of the vehicle's speed.
#pragma once

#include <cstdint>
#include <string>

#include "common/base/result.h"

namespace perdure::capture {

struct SpeedReading {
  std::int64_t time_ns = 0;  ///< CLOCK_BOOTTIME
  double speed = 0.0;        ///< m/s along the body's x axis; negative backwards
  double sigma = 0.0;        ///< m/s, standard deviation
};

/// Factor from a unit to m/s: m/s, km/h, mph, kn and their usual other names. Fails with
/// "speed_unit".
Result<double> metresPerSecond(const std::string& unit);

}  // namespace perdure::capture
