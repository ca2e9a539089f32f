// The schema `perdure` on the server: maps, the rows of their files, functions, and views with
// geometry.
#pragma once

#include <cstdint>

#include "common/base/result.h"
#include "services/map_store/fleet/link.h"

namespace perdure::map_store::fleet {

inline constexpr std::int64_t kServerSchema = 2;
/// Channel of notifications "MAP X Y": the map's number and the changed tile.
inline constexpr char kTilesChannel[] = "perdure_tiles";
/// Channel of notifications "MAP REVISION VEHICLE", one for each complete commit.
inline constexpr char kMapsChannel[] = "perdure_maps";

/// Creates missing parts of the schema; several processes may call it at once. Returns false if
/// PostGIS is missing, so that there are no views with geometry. Fails with the reasons of the
/// link, or with "server_schema" if the schema has another version or the encoding is not UTF-8.
Result<bool> prepareServer(Link& link);

}  // namespace perdure::map_store::fleet
