// Images of the simulated drive.
#pragma once

#include "common/types/sensors.h"
#include "tests/services/vio/simulated_drive.h"

namespace perdure::vio::test {

/// Draws the drive's points as discs of different grey values, as seen by camera `camera`.
Frame drawn(const SimulatedDrive& drive, double t, std::uint64_t sequence, std::size_t camera = 0);

}  // namespace perdure::vio::test
