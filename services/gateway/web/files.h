// The built page, read into memory once. Requests never open a file.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <string_view>

namespace perdure::gateway::web {

struct File {
  std::string type;  ///< HTTP type, for example "text/html; charset=utf-8"
  std::string content;
  std::string packed;  ///< content of FILE.gz if it exists; otherwise empty
  std::string tag;     ///< ETag, in quotes
};

class Files {
 public:
  Files() = default;
  /// Reads all files below the folder. Reads none if the folder does not exist or has no
  /// index.html. Throws StartupError if a file cannot be read, or if all files exceed 64 MiB.
  explicit Files(const std::filesystem::path& folder);

  /// Returns the file of a path such as "/viewer.js"; "/" is index.html. Returns nullptr for
  /// unknown paths.
  std::shared_ptr<const File> find(std::string_view path) const;
  bool empty() const { return files_.empty(); }
  /// Replaces each `from` by `to` in the file `path`, if it exists.
  void replaceIn(const std::string& path, const std::string& from, const std::string& to);

 private:
  std::map<std::string, std::shared_ptr<const File>, std::less<>> files_;
};

/// Returns the default folder of the page: share/perdure/viewer of the program's installation.
std::filesystem::path usualPageFolder();

}  // namespace perdure::gateway::web
