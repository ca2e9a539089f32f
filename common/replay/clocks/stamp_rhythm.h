// Recognises stamps of arrival by their rhythm: sensors measure at nearly constant intervals, which
// the latency of a bus or of a host changes.
#pragma once

#include "common/replay/data_check.h"

namespace perdure::replay {

/// Adds stamps_of_arrival if a long interval of the images is followed by a short one, as a latency
/// that varies by several milliseconds causes. Slow changes of the frame rate and lost images have
/// no effect.
void checkArrival(const std::vector<TimePoint>& images, DataFindings& findings);

/// Adds imu_bursts if most samples follow another almost at once, because they were read in packets
/// from a FIFO. Returns whether it did.
bool checkBursts(const std::vector<TimePoint>& imu, DataFindings& findings);

}  // namespace perdure::replay
