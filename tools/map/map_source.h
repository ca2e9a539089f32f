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

/// Queries map_store over the bus. Waits until reader and writer are matched, because DDS drops
/// earlier requests silently. Then repeats the same request until a reply arrives. After
/// `patience_s`, fails with "no_map_store" or "no_answer".
Result<MapReply> askMapStore(const bus::Participant& participant, MapQuery query,
                             double patience_s);

/// Frame of the objects from a map's file: the consistent frame M, or the stored frame W.
enum class MapFrameChoice { kM, kW };

/// Reads a map's file, which a service may use at the same time. Searches positions in query.world;
/// without one, in the M or W of the newest session.
MapReply askMapFile(const std::string& path, const MapQuery& query,
                    MapFrameChoice frame = MapFrameChoice::kM);
/// The graph of a map's file, in the form of a running map_store. Throws StartupError.
MapReply askGraphOfFile(const std::string& path, const MapQuery& query);
/// Geographic origin of the newest session's M, and its yaw; empty if none. Throws StartupError.
std::optional<GeoAnchor> earthAnchorOfMapFile(const std::string& path);
Standing askStanding(const std::string& path, ObjectId id);

}  // namespace perdure::tools
