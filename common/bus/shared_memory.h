// Whether messages may go through shared memory: iceoryx's RouDi must answer, or Cyclone would wait
// for it for a minute and abort.
#pragma once

#include <string>

#include "common/base/result.h"

namespace perdure::bus {

/// One start of RouDi on this host, as a locator of Cyclone. Processes of the same one share
/// memory; others, those from before a restart of RouDi among them, meet over the network
/// interface. Reasons: "no_roudi" (the detail says the mend).
Result<std::string> sharedMemoryLocator();

}  // namespace perdure::bus
