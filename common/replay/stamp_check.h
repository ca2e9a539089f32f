// Checks whether stamps are times in nanoseconds.
#pragma once

#include "common/replay/data_check.h"

namespace perdure::replay {

/// Codes: stamps_equal, stamps_count (an index instead of a time), stamps_unit. A fatal finding
/// also explains later findings about rates and clocks.
void checkStamps(const Recording& recording, const DataUse& use, DataFindings& findings);

/// The factor that gives both the rates of an IMU (20 … 4000 Hz) and of a camera (1 … 200 Hz): 1000
/// or 1000000. It is 1 if the rates are plausible already, or if no common factor makes them so.
std::int64_t factorOfStamps(std::vector<TimePoint> imu, std::vector<TimePoint> images);

}  // namespace perdure::replay
