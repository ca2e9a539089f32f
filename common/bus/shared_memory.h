// Shared memory needs a responding RouDi, because Cyclone would otherwise wait and abort.
#pragma once

#include <string>

#include "common/base/result.h"

namespace perdure::bus {

/// A locator that identifies one start of RouDi on this host; processes with the same one share
/// memory. Reason: "no_roudi".
Result<std::string> sharedMemoryLocator();

}  // namespace perdure::bus
