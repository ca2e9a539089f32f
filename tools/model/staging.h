// Writes related files as one unit: first to a temporary folder beside them, from which all are
// moved or none.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tools/base/files.h"

namespace perdure::tools {

/// Creates a temporary folder in `parent`. Throws StartupError: kInputOutput if the disk is full,
/// otherwise kUnavailable.
TemporaryFolder temporaryFolder(const std::filesystem::path& parent, const std::string& prefix,
                                const std::string& fix);

/// Stores files on the disk of `folder` until they are moved there. The folder need not exist yet.
class Staging {
 public:
  explicit Staging(std::filesystem::path folder);

  const std::filesystem::path& path() const { return waiting_.path(); }
  /// Returns the message with the paths of the final folder in place of the temporary ones.
  std::string said(std::string message) const;
  /// Moves all files to the folder. If this fails, restores the folder and throws StartupError.
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
