// Parameters of the fleet's server and of the map's name on it.
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

}  // namespace perdure::map_store::fleet
