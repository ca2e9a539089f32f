// File of the saved state, written atomically.
#pragma once

#include <optional>
#include <string>

#include "common/base/result.h"

namespace perdure::vio {

class StateFile {
 public:
  /// Creates the directory. Throws StartupError if it cannot be created. If `directory` is empty,
  /// nothing is saved.
  explicit StateFile(const std::string& directory);
  /// Returns the text of the file; nothing if there is no file.
  std::optional<std::string> read() const;
  /// Writes a temporary file and renames it. Fails with "state_not_written".
  Result<void> write(const std::string& text) const;

 private:
  std::string path_;
};

}  // namespace perdure::vio
