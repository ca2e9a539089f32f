// Reserves an output folder for one process.
#pragma once

#include <filesystem>
#include <string>

#include "common/base/process/descriptor.h"

namespace perdure {

/// " (process 12)": the process that locks a file or folder for writing, if the kernel names it.
/// The file is not opened, because closing it would release locks of this process.
std::string lockerOf(const std::filesystem::path& path);

/// Locks the folder until this object or the process ends.
class FolderLock {
 public:
  /// Creates the folder if it is missing. Throws StartupError(kUnavailable) if it cannot be created
  /// or written, or if another process holds it. On file systems without locks the folder is not
  /// reserved.
  explicit FolderLock(std::filesystem::path folder);

  /// Whether the folder was neither removed nor replaced since.
  bool holds() const;

 private:
  std::filesystem::path folder_;
  Descriptor descriptor_;
};

}  // namespace perdure
