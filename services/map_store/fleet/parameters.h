// Where a fleet's maps are gathered, and as what.
#pragma once

#include <string>
#include <vector>

namespace perdure::map_store::fleet {

struct Parameters {
  std::string url;      ///< of a PostgreSQL database; empty: there is no server
  std::string vehicle;  ///< the name that the map has there; empty: the host's
  /// Of M: latitude and longitude [°, WGS 84], height over the ellipsoid [m], yaw of the x axis
  /// from east [°]. Empty: as the map's file knows it, if it does.
  std::vector<double> earth_anchor;
};

}  // namespace perdure::map_store::fleet
