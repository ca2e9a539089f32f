// Where the services' settings of this host are, and what they say of the bus.
#pragma once

#include <string>

#include "common/bus/domain.h"

namespace perdure::tools {

/// The services' configuration files: of the installation (/etc/perdure) or of config/ here.
/// Empty where there is none.
std::string configurationFolder();

/// What bus.yaml there says, or the file that the variable PERDURE_BUS names. Throws StartupError.
bus::Options servicesOptions();
/// The same for what only listens: without shared memory and the services' identity.
bus::Options listenersOptions();

/// The names that exist, for the error message of an unknown one.
std::string knownTopics();

}  // namespace perdure::tools
