// The contents of folders.
#pragma once

#include <algorithm>
#include <filesystem>
#include <system_error>
#include <vector>

#include "common/base/errors.h"

namespace perdure {

/// Returns the sorted paths in a folder for which `wanted` returns true; none if the folder is
/// missing. Throws StartupError if the folder cannot be read.
std::vector<std::filesystem::path> pathsIn(const std::filesystem::path& folder,
                                           const auto& wanted) {
  std::vector<std::filesystem::path> paths;
  std::error_code error;
  const std::filesystem::directory_iterator entries(folder, error);
  if (error && error != std::errc::no_such_file_or_directory &&
      error != std::errc::not_a_directory) {
    throw StartupError(ExitCode::kUnavailable, folder.string() +
                                                   " cannot be read: " + error.message() +
                                                   "; allow this user to read it (chmod u+rx)");
  }
  for (const auto& entry : entries) {
    if (wanted(entry.path())) paths.push_back(entry.path());
  }
  std::sort(paths.begin(), paths.end());
  return paths;
}

}  // namespace perdure
