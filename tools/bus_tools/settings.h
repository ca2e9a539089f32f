// Location and content of the services' bus settings on this host.
#pragma once

#include <string>

#include "common/bus/domain.h"

namespace perdure::tools {

/// /etc/perdure, or config/ in the working directory; empty if neither exists.
std::string configurationFolder();

/// The options of the services: bus.yaml, or the file of PERDURE_BUS. Throws StartupError.
bus::Options servicesOptions();
/// Returns these options for readers: without shared memory and without the services' identity.
bus::Options listenersOptions();

/// The existing topic names, for the error message about an unknown topic.
std::string knownTopics();

}  // namespace perdure::tools
