// Location and content of the services' bus settings on this host.
#pragma once

#include <string>

#include "common/bus/domain.h"

namespace perdure::tools {

/// The folder of the services' configuration files: /etc/perdure of an installation, or config/ in
/// the working directory. Empty if neither exists.
std::string configurationFolder();

/// The options in bus.yaml of that folder, or in the file that PERDURE_BUS names. Throws
/// StartupError.
bus::Options servicesOptions();
/// Returns these options for readers: without shared memory and without the services' identity.
bus::Options listenersOptions();

/// The existing topic names, for the error message about an unknown topic.
std::string knownTopics();

}  // namespace perdure::tools
