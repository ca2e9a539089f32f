// A folder of recordings. File names sort by time; one recorder at a time writes; a quota limits
// it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "common/base/files/folder_lock.h"

namespace perdure::tools {

class SegmentFolder {
 public:
  /// Creates and locks the folder, and completes files of a killed recorder. `quota` and
  /// `keep_free` are in bytes; quota 0: none. Throws StartupError if the folder cannot be written,
  /// or if another recorder uses it.
  SegmentFolder(const std::filesystem::path& folder, std::uint64_t quota, std::uint64_t keep_free);

  /// Returns a path like "FOLDER/perdure-000124-20261122T091658Z.mcap"; `word`, such as "-fault",
  /// follows the time.
  std::filesystem::path nextFile(std::int64_t wall_ns, const std::string& word);
  void sizeIs(const std::filesystem::path& file, std::uint64_t bytes) { sizes_[file] = bytes; }
  void remove(const std::filesystem::path& file);
  /// Removes the oldest files until the quota is met, but never the newest.
  void keepQuota();
  /// The largest possible file in bytes, by the limit of this process (`ulimit -f`) and by FAT.
  std::uint64_t largestFile() const;
  bool hasRoomFor(std::uint64_t bytes) const;

  std::uint64_t bytes() const;
  std::uint64_t quota() const { return quota_; }
  std::uint64_t removed() const { return removed_; }
  const std::vector<std::string>& repaired() const { return repaired_; }

 private:
  void findFiles();

  std::filesystem::path folder_;
  FolderLock lock_;
  std::uint64_t quota_, keep_free_, removed_ = 0, next_number_ = 1;
  std::map<std::filesystem::path, std::uint64_t> sizes_;  // order by name is order by time
  std::vector<std::string> repaired_;
};

}  // namespace perdure::tools
