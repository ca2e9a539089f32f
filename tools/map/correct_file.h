// Corrects a map's file that no program has opened.
#pragma once

#include <string>

#include "common/types/map.h"

namespace perdure::tools {

/// Runs a map_store on the file for one correction. Throws StartupError if another program has
/// opened the map, because a map_store would not notice the correction, or if the file is damaged
/// or is sent to a server.
MapReply correctFile(const std::string& path, const Correction& correction);

}  // namespace perdure::tools
