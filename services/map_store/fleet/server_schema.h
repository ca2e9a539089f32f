// The schema `perdure`: maps, the rows of their files, functions, and views with geometry.
#pragma once

#include <cstdint>

#include "common/base/result.h"
#include "services/map_store/fleet/link.h"

namespace perdure::map_store::fleet {

inline constexpr std::int64_t kServerSchema = 2;
/// Payload: "MAP X Y": the map's number and the changed tile.
inline constexpr char kTilesChannel[] = "perdure_tiles";
/// Payload: "MAP REVISION VEHICLE", once for each complete commit.
inline constexpr char kMapsChannel[] = "perdure_maps";

/// Creates missing parts; several processes may call it at once. Returns false without PostGIS (no
/// geometry). Reasons: those of the link, and "server_schema" (a newer schema, or another
/// encoding).
Result<bool> prepareServer(Link& link);

}  // namespace perdure::map_store::fleet
