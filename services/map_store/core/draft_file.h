// Writes a database to a draft file and renames it when it is complete.
#pragma once

#include <filesystem>
#include <string>

namespace perdure::map_store {

/// Suffixes of the files that SQLite may leave beside a database.
inline constexpr const char* kBeside[] = {"-wal", "-shm", "-journal"};

/// The file `path`.part. The destructor removes it and its SQLite files unless it was renamed.
class DraftFile {
 public:
  explicit DraftFile(const std::string& path);
  ~DraftFile() { remove(); }
  DraftFile(const DraftFile&) = delete;
  DraftFile& operator=(const DraftFile&) = delete;
  const std::string& path() const { return path_; }

 private:
  void remove() const;
  std::string path_;
};

/// Syncs a file or a folder to disk. Not every file system can sync a folder.
bool sync(const std::filesystem::path& path);

}  // namespace perdure::map_store
