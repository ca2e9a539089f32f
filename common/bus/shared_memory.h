// Checks whether messages may use shared memory. RouDi of iceoryx must respond, because Cyclone
// would otherwise wait for a minute and abort.
#pragma once

#include <string>

#include "common/base/result.h"

namespace perdure::bus {

/// A Cyclone locator that identifies one start of RouDi on this host. Processes with the same
/// locator share memory. Others, for example from before a restart of RouDi, communicate over the
/// network interface. Reason: "no_roudi"; the detail states the fix.
Result<std::string> sharedMemoryLocator();

}  // namespace perdure::bus
