// Checks whether messages may use shared memory. RouDi of iceoryx must respond, because Cyclone
// would otherwise wait for a minute and abort.
#pragma once

#include <string>

#include "common/base/result.h"

namespace perdure::bus {

/// Returns a Cyclone locator that identifies the running RouDi. Processes with equal locators share
/// memory. Processes with different ones, for example after a restart of RouDi, communicate over
/// the network interface. Fails with "no_roudi" if RouDi does not respond; the detail states the
/// fix.
Result<std::string> sharedMemoryLocator();

}  // namespace perdure::bus
