// Makes images enter shared memory with one copy. Internal to common/bus.
#pragma once

#include <cstdint>

namespace perdure::bus {

/// Cyclone 0.10.2 determines the size of a variable-length message in shared memory by serialising
/// it, including its pixels, and discards the result. After this call the type of this topic of
/// frames computes the size instead. It has no effect if Cyclone's interface differs from the
/// expected one.
void tellSizesOfFrames(std::int32_t participant, std::int32_t topic);

}  // namespace perdure::bus
