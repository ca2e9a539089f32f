// What the configuration says of a server, checked before anything is tried.
#pragma once

#include <string>
#include <vector>

#include "services/map_store/fleet/parameters.h"

namespace perdure::map_store::fleet {

/// Whether this program was built with PostgreSQL's library.
bool isBuilt();

/// Throws StartupError (78) with the mend: not a URL of PostgreSQL's, a password in it, no library.
/// `key`: what it is called to whoever gave it ("store.url", "--url"). The URL is not repeated: who
/// puts a password there by mistake should not find it in a log.
void checkUrl(const std::string& url, const std::string& key);

/// Of a map, on the server and as a file's name: 1 to 100 bytes, no "/", no control characters, no
/// dot in front. Throws StartupError (78).
void checkName(const std::string& name, const std::string& key);
/// Nothing, or four numbers (parameters.h) that are a place. Throws StartupError (78).
void checkEarthAnchor(const std::vector<double>& anchor, const std::string& key);

/// All of the parameters; does nothing where there is no server.
void check(const Parameters& parameters);

/// The vehicle's name, the host's where none is given.
std::string vehicleOf(const Parameters& parameters);

}  // namespace perdure::map_store::fleet
