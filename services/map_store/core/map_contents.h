// Reads a whole map file, including history, into memory, and writes it as a new file.
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
  std::string earth_anchor;  ///< position of M on Earth (earth_place.h); empty if not known
  std::string cameras;       ///< what its cameras see (mapping/frames/sight.h); empty if not known
  /// Number of rows, and of parts of the graph, that were left out because they were unreadable.
  std::uint64_t malformed = 0;
};

/// Reads one state of the file, even while a service writes to it. Graph or provenance are empty if
/// the map has none. Does not read the filter's working set, because its confirmed tracks are among
/// the objects. No object of the result is visible.
Result<WholeMap> readWholeMap(const Connection& connection);

/// Writes a new file, complete and synced, or nothing. Its tables `provenance` and `changes` have
/// the members of mapping::Origin and mapping::Change. `path` must not exist unless `replace` is
/// true. The draft is `path`.part. `max_size_mb` is the largest size of the file; 0: no limit.
/// Throws StartupError with the fix.
void writeWholeMap(const WholeMap& map, const std::string& path, bool replace,
                   std::int64_t max_size_mb = 0);

/// Throws StartupError if a new file cannot be written at `path`. Call it before long work.
void checkNewFile(const std::string& path, bool replace);

}  // namespace perdure::map_store
