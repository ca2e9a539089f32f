// Images go into shared memory in one copy. Internal to common/bus.
#pragma once

#include <cstdint>

namespace perdure::bus {

/// Cyclone 0.10.2 finds out how much shared memory a message of variable size needs by serialising
/// it, pixels and all, and throwing the result away. After this call its type, as writers of this
/// topic of frames use it, computes the size. Without effect where Cyclone is not as expected.
void tellSizesOfFrames(std::int32_t participant, std::int32_t topic);

}  // namespace perdure::bus
