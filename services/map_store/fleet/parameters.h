// Parameters of the fleet's server and of the map's name on it.
#pragma once

#include <string>
#include <vector>

namespace perdure::map_store::fleet {

struct Parameters {
  std::string url;      ///< URL of a PostgreSQL database; empty: no server
  std::string vehicle;  ///< name of the map on the server; empty: the host name
  /// Position of M: latitude and longitude [°, WGS 84], height above the ellipsoid [m], yaw of the
  /// x axis from east [°]. Empty: as in the map's file, if present.
  std::vector<double> earth_anchor;
};

}  // namespace perdure::map_store::fleet
