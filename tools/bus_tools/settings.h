// Finds and reads the services' bus settings on this host.
#pragma once

#include <string>

#include "common/bus/domain.h"

namespace perdure::tools {

/// /etc/perdure, or config/ in the working directory; empty if neither exists.
std::string configurationFolder();

/// Reads the services' options from bus.yaml or the file in PERDURE_BUS. Throws StartupError if the
/// file is invalid.
bus::Options servicesOptions();
/// Returns the same options for programs that only read: without shared memory and without the
/// services' identity.
bus::Options listenersOptions();

/// The existing topic names, for the error message about an unknown topic.
std::string knownTopics();

}  // namespace perdure::tools
