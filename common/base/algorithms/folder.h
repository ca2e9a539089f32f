// The contents of folders.
#pragma once

#include <algorithm>
#include <filesystem>
#include <vector>

namespace perdure {

/// The paths in a folder for which `wanted` returns true, sorted. Empty if the folder cannot be
/// read.
std::vector<std::filesystem::path> pathsIn(const std::filesystem::path& folder,
                                           const auto& wanted) {
  std::vector<std::filesystem::path> paths;
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator(folder, ignored)) {
    if (wanted(entry.path())) paths.push_back(entry.path());
  }
  std::sort(paths.begin(), paths.end());
  return paths;
}

}  // namespace perdure
