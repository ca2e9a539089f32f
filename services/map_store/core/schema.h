// The map's file: opened, checked, created; what is damaged is set aside and never overwritten.
#pragma once

#include <cstdint>
#include <string>

#include "services/map_store/core/sqlite.h"

namespace perdure::map_store {

/// "PERD" in the database's header: tells our files from other programs'.
inline constexpr int kApplicationId = 0x50455244;
/// 2: beliefs with ledgers. 3: the pose graph. 4: tracks that are one object. Older maps are read as
/// they are, and become one of 4 when they are opened to be written.
inline constexpr int kSchemaVersion = 4;

struct StoreOptions {
  std::string path;
  double tile_size_m = 32.0;
  std::int64_t max_size_mb = 0;  ///< 0: as large as the disk
  bool check_at_start = true;
  bool outbox = false;  ///< changes are gathered for a server (core/outbox.h)
};

struct OpenedStore {
  Connection connection;
  std::string notice;  ///< a sentence where a damaged file was set aside, else empty
};

/// What a database says of itself.
struct Identity {
  std::int64_t application = 0, version = 0, tables = 0;
  bool empty() const { return application == 0 && version == 0 && tables == 0; }
};
Result<Identity> identityOf(const Connection& connection);

/// Reads the whole file: "corrupt" where it is damaged.
Result<void> wholeFileIsSound(const Connection& connection);

/// Opens for the service. Throws StartupError with the mend where the place cannot be written, the
/// file is not a map of Perdure's, or a newer version made it.
OpenedStore openStore(const StoreOptions& options);

/// Opens an existing map for reading only, also while the service runs. Throws StartupError.
Connection openStoreForReading(const std::string& path);

}  // namespace perdure::map_store
