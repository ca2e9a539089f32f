// Results that belong together: written beside their folder's files, and all there or none.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace perdure::tools {

/// A folder that is gone with its owner.
class TemporaryFolder {
 public:
  /// In `parent`. Throws StartupError(kInputOutput) where the disk is full, else kUnavailable.
  TemporaryFolder(const std::filesystem::path& parent, const std::string& prefix,
                  const std::string& mend);
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

/// Where files wait for their place in a folder, on the same disk. The folder need not exist.
class Staging {
 public:
  explicit Staging(std::filesystem::path folder);

  const std::filesystem::path& path() const { return waiting_.path(); }
  /// The message as it is for those who know of the folder alone.
  std::string said(std::string message) const;
  /// Gives all files their place. Throws StartupError where that fails: then the folder has what
  /// it had.
  void publish();

 private:
  struct Move {
    std::filesystem::path from, to, former;  ///< former: where what was at `to` waits; "": nothing
  };
  std::vector<Move> moves() const;
  static void carryOut(const Move& move);
  static void takeBack(const Move& move);

  std::filesystem::path folder_;
  TemporaryFolder waiting_;
};

}  // namespace perdure::tools
