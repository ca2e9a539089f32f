// Checks the configuration of a server before the first connection.
#pragma once

#include <string>
#include <vector>

namespace perdure::map_store::fleet {

struct Parameters {
  std::string url;      ///< URL of a PostgreSQL database; empty: no server
  std::string vehicle;  ///< name of the map on the server; empty: the host name
  /// M: latitude, longitude [°, WGS 84], height [m], yaw from east [°]; empty: as in the file.
  std::vector<double> earth_anchor;
};

/// Whether this program was built with PostgreSQL's library.
bool isBuilt();

/// Throws StartupError (78) with the fix: not a URL of PostgreSQL, a password in it, no library.
/// `key`: the setting or option that has the URL ("store.url", "--url"). The message does not
/// repeat the URL, so that a password in it does not reach a log.
void checkUrl(const std::string& url, const std::string& key);

/// Checks the name of a map, on the server and as a file: 1 to 100 bytes, no "/", no control
/// characters, no leading dot. Throws StartupError (78).
void checkName(const std::string& name, const std::string& key);
/// Accepts an empty vector, or four numbers (parameters.h) of a place; else StartupError (78).
void checkEarthAnchor(const std::vector<double>& anchor, const std::string& key);

/// Checks all parameters; does nothing without a server.
void check(const Parameters& parameters);

/// The vehicle's name, or the host name if none is configured.
std::string vehicleOf(const Parameters& parameters);

}  // namespace perdure::map_store::fleet
