// Judges the clocks of a recording: changes in mid-drive, units, rates, and whether camera and IMU
// share one clock.
#pragma once

#include "common/replay/data_check.h"

namespace perdure::replay {

/// Continues the streams of a recording alike, after they were read one by one
/// (files/stamp_order.h): a clock that was set by the same amount for IMU and images gets the
/// IMU's amount in both, and a counter that wrapped in one of them only is continued in the
/// other.
void settleClocks(Recording& recording);

/// Codes: clock_wrapped, clock_set, clock_set_alone, clock_paused, stamps_equal, stamps_count (an
/// index instead of a time), stamps_unit, clocks_apart, imu_covers_part, imu_rate. A fatal finding
/// about units explains later ones about rates.
DataFindings checkClocks(const Recording& recording, const DataUse& use);

/// The findings about changes in mid-drive: clock_wrapped, clock_set, clock_set_alone,
/// clock_paused.
void checkClockChanges(const Recording& recording, const DataUse& use, DataFindings& findings);

/// A known cause of a difference of two clocks in seconds, such as ", as GPS time is ahead of UTC".
/// Otherwise "".
std::string causeOfShift(double seconds);

/// The factor that gives both the rates of an IMU (20 … 4000 Hz) and of a camera (1 … 200 Hz): 1000
/// or 1000000. It is 1 if the rates are plausible already, or if no common factor makes them so.
std::int64_t factorOfStamps(std::vector<TimePoint> imu, std::vector<TimePoint> images);

}  // namespace perdure::replay
