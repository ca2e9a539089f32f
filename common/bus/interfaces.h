// The network interfaces of this host.
#pragma once

#include <string>

namespace perdure::bus {

/// Names of the interfaces that are up and have an IPv4 address, as "lo,eth0": loopback first, at
/// most as many as Cyclone uses.
std::string interfacesUp();
/// The IPv4 address of an interface; its name if it has none, so that Cyclone reports the error.
std::string addressOf(const std::string& interface);

}  // namespace perdure::bus
