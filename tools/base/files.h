// Temporary folders for tools.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <string>
#include <system_error>

namespace perdure::tools {

/// A folder that the destructor removes with its content.
class TemporaryFolder {
 public:
  /// Creates a folder whose path starts with `start`. On failure, calls `fail` with the path, which
  /// must throw; errno has the reason.
  template <class Fail>
  TemporaryFolder(const std::filesystem::path& start, Fail&& fail) {
    std::string name = start.string() + "XXXXXX";
    if (mkdtemp(name.data()) == nullptr) fail(name);
    path_ = name;
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace perdure::tools
