// Sends map queries to the running map_store over DDS, or to its file.
#pragma once

#include <optional>
#include <string>

#include "common/base/result.h"
#include "common/bus/domain.h"
#include "common/types/map.h"
#include "common/types/sensors.h"
#include "services/map_store/core/map_database.h"
#include "tools/map/standing.h"

namespace perdure::tools {

/// Queries map_store over the bus. Waits until reader and writer are matched, because DDS silently
/// drops earlier requests. Then repeats the request until a reply arrives. After `patience_s`,
/// fails with "no_map_store" if nothing matched, else with "no_answer".
Result<MapReply> askMapStore(const bus::Participant& participant, MapQuery query,
                             double patience_s);

/// The frame of objects from a map's file: M, or W as stored.
enum class MapFrameChoice { kM, kW };

/// Answers a query from a map's file, which a service may use at the same time. Spatial queries
/// search query.world; if it is 0, they search the M or W of the newest session. If it is not 0,
/// objects are in W. Throws StartupError.
MapReply askMapFile(const std::string& path, const MapQuery& query,
                    MapFrameChoice frame = MapFrameChoice::kM);
/// Returns the graph of a map's file as a running map_store would. Throws StartupError.
MapReply askGraphOfFile(const std::string& path, const MapQuery& query);
/// Returns the position of M's origin on Earth, and the yaw of M. Returns nothing if the file has
/// none, or if the newest session is not joined to the map. Throws StartupError.
std::optional<GeoAnchor> earthAnchorOfMapFile(const std::string& path);
/// Returns the standing of an object in a map's file. Throws StartupError if it is absent.
Standing askStanding(const std::string& path, ObjectId id);

}  // namespace perdure::tools
