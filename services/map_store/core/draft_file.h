// Writes a database to a draft file and renames it when it is complete.
#pragma once

#include <string>

#include "common/base/result.h"

namespace perdure::map_store {

/// Suffixes of the files that SQLite may leave beside a database.
inline constexpr const char* kBeside[] = {"-wal", "-shm", "-journal"};

/// Throws StartupError: "The map PATH cannot be written (why); the fix."
[[noreturn]] void cannotWriteMap(const std::string& path, const Reason& reason);

/// The file `path`.part. The destructor removes it and the files of SQLite beside it, unless keep()
/// renamed it.
class DraftFile {
 public:
  explicit DraftFile(const std::string& path);
  ~DraftFile() { remove(); }
  DraftFile(const DraftFile&) = delete;
  DraftFile& operator=(const DraftFile&) = delete;
  const std::string& path() const { return path_; }
  /// Syncs the draft and renames it to `path`. Throws as cannotWriteMap() does.
  void keep() const;

 private:
  void remove() const;
  std::string final_, path_;
};

}  // namespace perdure::map_store
