// `perdure map fuse --url`: the maps of a fleet's vehicles as one, on their server.
#pragma once

#include <string>

#include "tools/map/fuse.h"

namespace perdure::tools {

/// Brings the newest map of each vehicle on the server, and the files of the request, together, and
/// makes the result the map `name` there. An earlier one of this name is replaced, not brought
/// along: what it rests on is in the vehicles' maps. Vehicles that are in the midst of sending are
/// left out. request.out: also as a file; "": on the server only. Throws StartupError.
FuseOutcome fuseFleet(FuseRequest request, const std::string& url, const std::string& name);

}  // namespace perdure::tools
