// Where questions about the map go: to the running map_store over DDS, or to its file.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/bus/domain.h"
#include "common/types/map.h"
#include "common/types/sensors.h"
#include "services/map_store/core/map_database.h"
#include "tools/map/standing.h"

namespace perdure::tools {

/// Asks map_store on the bus: waits until both directions are matched, then sends the same request
/// until it is answered (a question sent before that is lost silently). After `patience_s` the
/// reason is "no_map_store" or "no_answer".
Result<MapReply> askMapStore(const bus::Participant& participant, MapQuery query,
                             double patience_s);

/// How what a map's file holds is laid: in M, in which it is one, or in the W in which it is
/// stored.
enum class MapFrameChoice { kM, kW };

/// Reads a map's file, also beside the running service. Places are looked for in query.world, or
/// where it names none in the newest session's M, or its W.
MapReply askMapFile(const std::string& path, const MapQuery& query,
                    MapFrameChoice frame = MapFrameChoice::kM);
/// The graph of a map's file, as a running map_store would tell it. Throws StartupError.
MapReply askGraphOfFile(const std::string& path, const MapQuery& query);
/// Where on Earth the origin of the newest session's M lies, and its yaw; nothing where the file
/// does not know it. Throws StartupError.
std::optional<GeoAnchor> earthAnchorOfMapFile(const std::string& path);
/// Of an object that the file has. Throws StartupError.
Standing askStanding(const std::string& path, ObjectId id);
/// All objects of a map's file in full. Throws StartupError.
std::vector<map_store::PlacedBelief> beliefsOfMapFile(const std::string& path);

}  // namespace perdure::tools
