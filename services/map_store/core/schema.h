// The map's file: opened, checked, created; what is damaged is set aside and never overwritten.
#pragma once

#include <string>

#include "services/map_store/core/sqlite.h"

namespace perdure::map_store {

/// "PERD" in the database's header: tells our files from other programs'.
inline constexpr int kApplicationId = 0x50455244;
/// 2: beliefs with ledgers. A map of version 1 is read, and becomes one of 2 when it is written.
inline constexpr int kSchemaVersion = 2;

struct StoreOptions {
  std::string path;
  double tile_size_m = 32.0;
  std::int64_t max_size_mb = 0;  ///< 0: as large as the disk
  bool check_at_start = true;
};

struct OpenedStore {
  Connection connection;
  std::string notice;  ///< a sentence where a damaged file was set aside, else empty
};

/// Opens for the service. Throws StartupError with the mend where the place cannot be written, the
/// file is not a map of Perdure's, or a newer version made it.
OpenedStore openStore(const StoreOptions& options);

/// Opens an existing map for reading only, also while the service runs. Throws StartupError.
Connection openStoreForReading(const std::string& path);

}  // namespace perdure::map_store
