// The built page, read once into memory: what is asked for is looked up, never opened.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <string_view>

namespace perdure::gateway::web {

struct File {
  std::string type;  ///< of HTTP: "text/html; charset=utf-8"
  std::string content;
  std::string packed;  ///< the same by gzip, where FILE.gz lies beside it; else empty
  std::string tag;     ///< ETag, in quotes
};

class Files {
 public:
  Files() = default;
  /// All files below the folder; none where it does not exist or holds no index.html. Throws
  /// StartupError where one cannot be read, or all are more than 64 MiB.
  explicit Files(const std::filesystem::path& folder);

  /// Of "/viewer.js"; "/" is index.html. Empty where there is none.
  std::shared_ptr<const File> find(std::string_view path) const;
  bool empty() const { return files_.empty(); }
  /// Of one file, where it is there: each `from` becomes `to`.
  void replaceIn(const std::string& path, const std::string& from, const std::string& to);

 private:
  std::map<std::string, std::shared_ptr<const File>, std::less<>> files_;
};

/// Where the page is when nobody says: share/perdure/viewer beside the program's bin.
std::filesystem::path usualPageFolder();

}  // namespace perdure::gateway::web
