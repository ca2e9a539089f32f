// The folder of a run's results. Results of an earlier run stay until the new ones are complete.
#pragma once

#include <filesystem>

#include "common/base/files/folder_lock.h"

namespace perdure::tools {

/// If the folder has no earlier run, the files are written directly. Otherwise they are written to
/// the subfolder `unfinished`, and replace the earlier files when the run has ended. If the run
/// fails, the destructor removes the subfolder, and also a new folder that is still empty. The
/// folder is locked against other processes meanwhile.
class ResultsFolder {
 public:
  /// Locks the folder. Throws StartupError(kUnavailable) if another process writes to it, or if
  /// files of an unfinished run cannot be removed.
  explicit ResultsFolder(std::filesystem::path out);
  ResultsFolder(const ResultsFolder&) = delete;
  ResultsFolder& operator=(const ResultsFolder&) = delete;
  ~ResultsFolder();

  const std::filesystem::path& folder() const { return written_; }
  /// Replaces the earlier results. No file may be open. Throws StartupError(kInputOutput) if a file
  /// cannot be replaced.
  void keep();

 private:
  std::filesystem::path out_, written_;
  bool is_new_;
  FolderLock lock_;
};

}  // namespace perdure::tools
