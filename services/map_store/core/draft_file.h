// A database that is written beside its place and renamed when it is whole.
#pragma once

#include <filesystem>
#include <string>

namespace perdure::map_store {

/// What SQLite may leave beside a file.
inline constexpr const char* kBeside[] = {"-wal", "-shm", "-journal"};

/// The file `path`.part. It is removed at the end, with what lies beside it, unless it was renamed.
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

/// Of a file or a folder; not every file system can do the latter.
bool sync(const std::filesystem::path& path);

}  // namespace perdure::map_store
