// Checks the configuration of a server before the first connection.
#pragma once

#include <string>
#include <vector>

#include "services/map_store/fleet/parameters.h"

namespace perdure::map_store::fleet {

/// Whether this program was built with PostgreSQL's library.
bool isBuilt();

/// Throws StartupError (78) with the fix: not a URL of PostgreSQL, a password in it, no library.
/// `key`: the setting or option that has the URL ("store.url", "--url"). The message does not
/// repeat the URL, so that a password in it does not reach a log.
void checkUrl(const std::string& url, const std::string& key);

/// Checks the name of a map, on the server and as a file: 1 to 100 bytes, no "/", no control
/// characters, no leading dot. Throws StartupError (78).
void checkName(const std::string& name, const std::string& key);
/// Accepts an empty vector, or four numbers (parameters.h) that form a valid place. Throws
/// StartupError (78).
void checkEarthAnchor(const std::vector<double>& anchor, const std::string& key);

/// Checks all parameters; does nothing without a server.
void check(const Parameters& parameters);

/// The vehicle's name, or the host name if none is configured.
std::string vehicleOf(const Parameters& parameters);

}  // namespace perdure::map_store::fleet
