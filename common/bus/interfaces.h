// The network interfaces of this host.
#pragma once

#include <string>

namespace perdure::bus {

/// Returns the names of the interfaces that are up and have an IPv4 address, for example "lo,eth0".
/// Loopback is first; the number is limited to what Cyclone supports.
std::string interfacesUp();
/// Returns the IPv4 address of an interface. If it has none, returns its name, and Cyclone then
/// reports the error.
std::string addressOf(const std::string& interface);

}  // namespace perdure::bus
