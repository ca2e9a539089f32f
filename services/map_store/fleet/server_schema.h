// What the server has: schema `perdure` with a row for each map and the rows of the maps' files,
// its functions, and where PostGIS is there, views with geometry.
#pragma once

#include <cstdint>

#include "common/base/result.h"
#include "services/map_store/fleet/link.h"

namespace perdure::map_store::fleet {

inline constexpr std::int64_t kServerSchema = 2;
/// Payload: "MAP X Y", the map's number and the tile that changed there.
inline constexpr char kTilesChannel[] = "perdure_tiles";
/// Payload: "MAP REVISION VEHICLE", once a commit, when all of it is there.
inline constexpr char kMapsChannel[] = "perdure_maps";

/// Makes what is missing; several may try at once. False where there is no PostGIS, hence no
/// geometry. Besides the link's reasons: "server_schema" (a newer one, or another encoding).
Result<bool> prepareServer(Link& link);

}  // namespace perdure::map_store::fleet
