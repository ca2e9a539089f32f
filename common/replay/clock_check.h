// Judges the clocks of a recording: changes in mid-drive, units, rates, and whether camera and IMU
// share one clock.
#pragma once

#include "common/replay/data_check.h"

namespace perdure::replay {

/// Corrects streams together after they were read one by one (files/stamp_order.h). If the clock
/// was set by the same amount for IMU and images, both get the IMU's amount. If a counter wrapped
/// in only one of them, the other is continued too.
void settleClocks(Recording& recording);

/// Checks the clocks of a recording. Codes: clock_wrapped, clock_set, clock_set_alone,
/// clock_paused, stamps_equal, stamps_count (an index instead of a time), stamps_unit,
/// clocks_apart, declared_rates, imu_covers_part, imu_rate, stamps_of_arrival and imu_bursts. After
/// a fatal finding, ranges and rates are not checked.
DataFindings checkClocks(const Recording& recording, const DataUse& use);

/// Adds only the findings about changes in mid-drive: clock_wrapped, clock_set, clock_set_alone and
/// clock_paused.
void checkClockChanges(const Recording& recording, const DataUse& use, DataFindings& findings);

/// Returns a known cause of a difference of two clocks in seconds, such as ", as GPS time is ahead
/// of UTC by 18 s". Returns "" if there is none.
std::string causeOfShift(double seconds);

/// Returns the factor, 1000 or 1000000, that gives plausible rates to both an IMU (20 … 4000 Hz)
/// and a camera (1 … 200 Hz). Returns 1 if the rates are plausible already, or if no common factor
/// makes them so.
std::int64_t factorOfStamps(std::vector<TimePoint> imu, std::vector<TimePoint> images);

}  // namespace perdure::replay
