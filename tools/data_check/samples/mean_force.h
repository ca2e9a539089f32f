// Checks the accelerometer by the mean force over some seconds in a frame that does not turn, in
// which velocities change little: it must have the size of gravity and keep its direction.
#pragma once

#include "common/replay/data_check.h"

namespace perdure::tools {

/// Codes: accel_factor, accel_changes. Needs a gyroscope without faults.
replay::DataFindings checkMeanForce(const std::vector<ImuSample>& samples);

}  // namespace perdure::tools
