// Makes images enter shared memory with one copy. Internal to common/bus.
#pragma once

#include <cstdint>

namespace perdure::bus {

/// Cyclone 0.10.2 finds the size of a message in shared memory by serialising it with its pixels.
/// After this call the type of this topic of frames computes the size instead.
void tellSizesOfFrames(std::int32_t participant, std::int32_t topic);

}  // namespace perdure::bus
