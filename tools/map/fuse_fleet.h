// `perdure map fuse --url`: merges the maps of a fleet's vehicles on their server.
#pragma once

#include <string>

#include "tools/map/fuse.h"

namespace perdure::tools {

/// Merges the newest map of each vehicle with the files of the request and stores it on the server
/// as `name`, replacing an older one. Incomplete uploads are omitted. request.out: also a file; "":
/// none. Throws StartupError.
FuseOutcome fuseFleet(FuseRequest request, const std::string& url, const std::string& name);

}  // namespace perdure::tools
