// Fixes of `perdure doctor --fix` that are needed before a drive can be read. They repair tables in
// the layout of EuRoC whose stamps are not nanoseconds, or that have an orientation beside the
// samples.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "tools/base/files.h"

namespace perdure::tools {

/// A folder of links to a drive, with its fixed tables. The destructor removes it.
class RepairedText {
 public:
  /// Writes nothing if no such fix is needed. Throws StartupError: kData if a fix is needed but
  /// uncertain, kUnavailable if the folder cannot be created.
  explicit RepairedText(const std::filesystem::path& drive);

  /// The folder to read: `drive` itself if nothing was fixed.
  const std::filesystem::path& drive() const { return drive_; }
  const std::vector<std::string>& fixes() const { return fixes_; }  ///< one sentence for each fix

 private:
  std::filesystem::path drive_;
  std::optional<TemporaryFolder> temporary_;
  std::vector<std::string> fixes_;
};

}  // namespace perdure::tools
