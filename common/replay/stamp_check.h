// Whether stamps are times in nanoseconds at all.
#pragma once

#include "common/replay/data_check.h"

namespace perdure::replay {

/// Codes: stamps_equal, stamps_count (an index in their place), stamps_unit. What is fatal explains
/// what else would be said of rates and clocks.
void checkStamps(const Recording& recording, const DataUse& use, DataFindings& findings);

/// What both must be multiplied by so that rates are those of an IMU (20 … 4000 Hz) and of a camera
/// (1 … 200 Hz): 1000 or 1000000; 1 where they are such rates, or no one factor makes them so.
std::int64_t factorOfStamps(std::vector<TimePoint> imu, std::vector<TimePoint> images);

}  // namespace perdure::replay
