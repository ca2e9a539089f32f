// Opens, checks and creates the map's file. A damaged file is renamed, not overwritten.
#pragma once

#include <cstdint>
#include <string>

#include "services/map_store/core/sqlite.h"

namespace perdure::map_store {

/// "PERD" in the database's header distinguishes our files from those of other programs.
inline constexpr int kApplicationId = 0x50455244;
/// 2: beliefs with ledgers. 3: the pose graph. 4: tracks that share an object. Older maps can be
/// read; opening them for writing upgrades them to 4.
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
  std::string notice;  ///< a sentence if a damaged file was renamed, else empty
};

struct Identity {
  std::int64_t application = 0, version = 0, tables = 0;
  bool empty() const { return application == 0 && version == 0 && tables == 0; }
};
Result<Identity> identityOf(const Connection& connection);

/// Reads the whole file. Reason of failure: "corrupt" if it is damaged.
Result<void> wholeFileIsSound(const Connection& connection);

/// Opens the file for the service. Throws StartupError with the fix if the folder is not writable,
/// the file is not a map of ours, or a newer version wrote it.
OpenedStore openStore(const StoreOptions& options);

/// Whether the content of a file is the cause, rather than its disk or its folder.
bool isDamage(const Reason& reason);
/// Throws StartupError with the fix.
[[noreturn]] void cannotReadMap(const std::string& path, const Reason& reason);
/// Opens an existing map read-only, even while the service runs. Throws as cannotReadMap() does.
Connection openStoreForReading(const std::string& path);

}  // namespace perdure::map_store
