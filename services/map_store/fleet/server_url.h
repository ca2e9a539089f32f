// Checks the configuration of a server before the first connection.
#pragma once

#include <string>
#include <vector>

#include "services/map_store/fleet/parameters.h"

namespace perdure::map_store::fleet {

/// Whether this program was built with PostgreSQL's library.
bool isBuilt();

/// Throws StartupError (78): not a URL of PostgreSQL, a password in it, no library. `key`: its
/// setting or option. The message does not repeat the URL.
void checkUrl(const std::string& url, const std::string& key);

/// 1 to 100 bytes, no "/", no control characters, no leading dot; else StartupError (78).
void checkName(const std::string& name, const std::string& key);
/// Empty, or four numbers that form a valid place; else StartupError (78).
void checkEarthAnchor(const std::vector<double>& anchor, const std::string& key);

/// Checks all parameters; does nothing without a server.
void check(const Parameters& parameters);

/// The vehicle's name, or the host name if none is configured.
std::string vehicleOf(const Parameters& parameters);

}  // namespace perdure::map_store::fleet
