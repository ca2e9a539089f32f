// Opens, checks and creates the map's file. A damaged file is renamed, not overwritten.
#pragma once

#include <cstdint>
#include <string>

#include "services/map_store/core/sqlite.h"

namespace perdure::map_store {

/// "PERD" in the database's header distinguishes our files from those of other programs.
inline constexpr int kApplicationId = 0x50455244;
/// Version 2 adds ledgers to beliefs, 3 adds the pose graph, and 4 adds tracks that share an
/// object. Older maps can be read. Opening them for writing upgrades them to 4.
inline constexpr int kSchemaVersion = 4;

struct StoreOptions {
  std::string path;
  double tile_size_m = 32.0;
  std::int64_t max_size_mb = 0;  ///< 0: limited by the disk
  bool check_at_start = true;
  bool outbox = false;  ///< record changes for a server (core/outbox.h)
};

struct OpenedStore {
  Connection connection;
  std::string notice;  ///< a sentence for the user if a damaged file was renamed; else empty
};

struct Identity {
  std::int64_t application = 0, version = 0, tables = 0;
  bool empty() const { return application == 0 && version == 0 && tables == 0; }
};
Result<Identity> identityOf(const Connection& connection);

/// Reads and checks the whole file. Fails with "corrupt" if it is damaged.
Result<void> wholeFileIsSound(const Connection& connection);

/// Opens the file for the service. Renames a damaged file and creates a new one. Throws
/// StartupError with the fix if the folder is not writable, the file is not a map of Perdure, or a
/// newer version wrote it.
OpenedStore openStore(const StoreOptions& options);

/// Whether the reason is a damaged file, instead of a problem of its disk or folder.
bool isDamage(const Reason& reason);
/// Throws StartupError with the reason and the fix.
[[noreturn]] void cannotReadMap(const std::string& path, const Reason& reason);
/// Opens an existing map read-only, even while the service runs. Throws as cannotReadMap() does.
Connection openStoreForReading(const std::string& path);

}  // namespace perdure::map_store
