// Writes related results as one unit: beside the files of their folder, then moves all or none.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tools/base/files.h"

namespace perdure::tools {

/// A folder in `parent`. Throws StartupError: kInputOutput (disk full) or kUnavailable.
TemporaryFolder temporaryFolder(const std::filesystem::path& parent, const std::string& prefix,
                                const std::string& fix);

/// Holds files on the same disk until they are moved to a folder, which need not exist yet.
class Staging {
 public:
  explicit Staging(std::filesystem::path folder);

  const std::filesystem::path& path() const { return waiting_.path(); }
  /// The message with paths of the final folder.
  std::string said(std::string message) const;
  /// Moves all files to the folder. Throws StartupError on failure, and then restores the folder.
  void publish();

 private:
  struct Move {
    std::filesystem::path from, to, former;  ///< former: backup of an existing file at `to`, or ""
  };
  std::vector<Move> moves() const;
  static void carryOut(const Move& move);
  static void takeBack(const Move& move);

  std::filesystem::path folder_;
  TemporaryFolder waiting_;
};

}  // namespace perdure::tools
