// Reserves an output folder for one process.
#pragma once

#include <filesystem>
#include <string>

#include "common/base/process/descriptor.h"

namespace perdure {

/// Returns a text such as " (process 12)" that names the process with a write lock on a file or
/// folder; empty if the kernel names none. The file is not opened, because closing it would release
/// locks of this process.
std::string lockerOf(const std::filesystem::path& path);

/// Locks the folder until this object or the process ends.
class FolderLock {
 public:
  /// Creates the folder if it is missing. Throws StartupError(kUnavailable) if it cannot be created
  /// or written, or if another process has locked it. The folder is not reserved if the file system
  /// has no locks.
  explicit FolderLock(std::filesystem::path folder);

  /// Returns true if the folder was neither removed nor replaced after it was locked.
  bool holds() const;

 private:
  std::filesystem::path folder_;
  Descriptor descriptor_;
};

}  // namespace perdure
