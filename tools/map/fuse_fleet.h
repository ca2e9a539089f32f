// `perdure map fuse --url`: merges the maps of a fleet's vehicles on their server.
#pragma once

#include <string>

#include "tools/map/fuse.h"

namespace perdure::tools {

/// Merges the newest map of each vehicle on the server with the files of the request. Stores the
/// result there as the map `name`. An older map of this name is replaced but not merged, because
/// the vehicles' maps contain its data. Vehicles with an incomplete upload are omitted.
/// request.out: also writes this file; "": server only. Throws StartupError.
FuseOutcome fuseFleet(FuseRequest request, const std::string& url, const std::string& name);

}  // namespace perdure::tools
