// A map's file as a whole, history included: read into memory, and written as a new file.
#pragma once

#include <cstdint>
#include <string>

#include "common/base/result.h"
#include "common/mapping/fusion/map_contents.h"
#include "services/map_store/core/sqlite.h"

namespace perdure::map_store {

struct WholeMap {
  mapping::MapContents contents;
  double tile_size_m = 32.0;
  std::uint64_t revision = 0;
  std::int64_t schema = 0;
  std::string earth_anchor;  ///< where M lies (earth_place.h); empty: not known
  /// Rows and parts of the graph that could not be read; left out.
  std::uint64_t malformed = 0;
};

/// One state of the file, also while a service writes it. Of an older map without graph or
/// provenance these are empty. The working set that a filter had is not read: what of it was
/// confirmed is among the objects, and like all of them out of sight.
Result<WholeMap> readWholeMap(const Connection& connection);

/// Writes a new file, whole and synced, or nothing. `path` must not exist, or is replaced where
/// `replace`; a draft lies at `path`.part until it is renamed. The tables `provenance` and
/// `changes` are added; their columns are what mapping::Origin and mapping::Change say.
/// `max_size_mb`: 0, or the file grows no further. Throws StartupError with the mend.
void writeWholeMap(const WholeMap& map, const std::string& path, bool replace,
                   std::int64_t max_size_mb = 0);

/// Why a new file cannot be written at `path`; throws StartupError. For commands that take long.
void checkNewFile(const std::string& path, bool replace);

}  // namespace perdure::map_store
