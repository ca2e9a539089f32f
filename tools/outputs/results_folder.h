// The folder of a run's results; results of an earlier run stay until the new ones are complete.
#pragma once

#include <filesystem>

#include "common/base/files/folder_lock.h"

namespace perdure::tools {

/// A folder without a run is written directly. Otherwise files are written to a subfolder
/// `unfinished`, and replace the earlier ones when the run has ended. If the run fails, the
/// subfolder is removed, and so is a new folder that stayed empty. Other processes cannot write to
/// the folder meanwhile.
class ResultsFolder {
 public:
  /// Throws StartupError(kUnavailable) if another process writes, or remains cannot be removed.
  explicit ResultsFolder(std::filesystem::path out);
  ResultsFolder(const ResultsFolder&) = delete;
  ResultsFolder& operator=(const ResultsFolder&) = delete;
  ~ResultsFolder();

  const std::filesystem::path& folder() const { return written_; }
  /// Replaces the earlier results; no file may be open. Throws StartupError(kInputOutput).
  void keep();

 private:
  std::filesystem::path out_, written_;
  bool is_new_;
  FolderLock lock_;
};

}  // namespace perdure::tools
