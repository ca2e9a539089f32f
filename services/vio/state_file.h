// The saved state on disk: written whole or not at all.
#pragma once

#include <optional>
#include <string>

#include "common/base/result.h"

namespace perdure::vio {

class StateFile {
 public:
  /// An empty directory keeps nothing. Makes the directory; throws StartupError where it cannot.
  explicit StateFile(const std::string& directory);
  /// Nothing where there is no file.
  std::optional<std::string> read() const;
  /// Writes beside the file and renames. Fails with "state_not_written".
  Result<void> write(const std::string& text) const;

 private:
  std::string path_;
};

}  // namespace perdure::vio
