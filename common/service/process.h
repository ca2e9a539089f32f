// What the operating system says of and hears from this process.
#pragma once

#include <cstdint>

namespace perdure::service {

double processorSeconds();      ///< of all threads since the start
std::uint64_t residentBytes();  ///< of memory

/// systemd's protocol, where NOTIFY_SOCKET is set; else nothing.
void notifyReady();
void notifyStopping();
void notifyWatchdog();

}  // namespace perdure::service
