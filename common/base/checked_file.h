// Files of results that are whole or not there: written beside their name, and every write checked.
#pragma once

#include <filesystem>
#include <fstream>
#include <string_view>

namespace perdure {

/// Writes NAME.part and gives it its name when it is closed; what was there before stays until
/// then. What is no plain file (a device, a pipe) is written directly.
class CheckedFile {
 public:
  /// Throws StartupError(kUnavailable) where the file cannot be opened.
  explicit CheckedFile(std::filesystem::path file);
  CheckedFile(const CheckedFile&) = delete;
  CheckedFile& operator=(const CheckedFile&) = delete;
  /// Removes what was not closed.
  ~CheckedFile();

  std::ostream& stream() { return stream_; }
  /// Throws StartupError(kInputOutput), and removes what there is, where not all was written.
  void close();

 private:
  std::filesystem::path file_, written_;
  std::ofstream stream_;
};

/// The whole content at once; throws as CheckedFile does.
void writeChecked(const std::filesystem::path& file, std::string_view content);

/// Flushes a stream into `file` that stays open; throws StartupError(kInputOutput) where that, or
/// anything before, did not succeed.
void flushChecked(std::ostream& stream, const std::filesystem::path& file);

/// Throws StartupError(kInputOutput): "FILE: `why` (or the system's reason); free space, …".
[[noreturn]] void throwUnwritten(const std::filesystem::path& file, std::string_view why = {});

}  // namespace perdure
