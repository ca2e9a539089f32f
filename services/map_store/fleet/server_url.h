// Checks the configuration of a server before the first connection.
#pragma once

#include <string>
#include <vector>

namespace perdure::map_store::fleet {

struct Parameters {
  std::string url;      ///< URL of a PostgreSQL database; empty: no server
  std::string vehicle;  ///< name of the map on the server; empty: the host name
  /// M's origin: latitude, longitude [°, WGS 84], height above the ellipsoid [m], and yaw of M's x
  /// axis from east [°]. Empty: the position in the map's file is used.
  std::vector<double> earth_anchor;
};

/// Whether this program was built with PostgreSQL's library.
bool isBuilt();

/// Throws StartupError (78) with the fix if `url` is not a URL of PostgreSQL or contains a
/// password, or if the program was built without PostgreSQL's library. `key` is the setting or
/// option that has the URL ("store.url", "--url"). The message does not repeat the URL, so that no
/// password reaches a log.
void checkUrl(const std::string& url, const std::string& key);

/// Throws StartupError (78) unless `name` is valid as the name of a map and of a file: 1 to 100
/// bytes, no "/", no control characters, and no leading dot.
void checkName(const std::string& name, const std::string& key);
/// Throws StartupError (78) unless `anchor` is empty or a valid position
/// (Parameters::earth_anchor).
void checkEarthAnchor(const std::vector<double>& anchor, const std::string& key);

/// Checks all parameters with the functions above. Does nothing if there is no server.
void check(const Parameters& parameters);

/// The vehicle's name, or the host name if none is configured.
std::string vehicleOf(const Parameters& parameters);

}  // namespace perdure::map_store::fleet
