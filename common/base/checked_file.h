// Result files that are either complete or absent; every write is checked.
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string_view>

namespace perdure {

/// Writes NAME.part and renames it to NAME when it is closed; an existing file remains until then.
/// Devices and pipes are written directly.
class CheckedFile {
 public:
  /// Throws StartupError(kUnavailable) if the file cannot be opened.
  explicit CheckedFile(std::filesystem::path file);
  CheckedFile(const CheckedFile&) = delete;
  CheckedFile& operator=(const CheckedFile&) = delete;
  /// Removes the file if it was not closed.
  ~CheckedFile();

  std::ostream& stream() { return stream_; }
  /// Completes the file. If a write failed, removes the temporary file and throws
  /// StartupError(kInputOutput).
  void close();

 private:
  std::filesystem::path file_, written_;
  std::ofstream stream_;
};

/// Writes the whole content at once. Throws like CheckedFile.
void writeChecked(const std::filesystem::path& file, std::string_view content);

/// Flushes a stream into `file`, which stays open. Throws StartupError(kInputOutput) if the flush
/// or an earlier write failed.
void flushChecked(std::ostream& stream, const std::filesystem::path& file);

/// The largest size of a file that this process may write, in bytes. Returns nothing if there is no
/// limit (ulimit -f).
std::optional<std::uint64_t> fileSizeLimit();

/// Throws StartupError(kInputOutput) with the message "FILE: `why`; free space, …". If `why` is
/// empty, the reason is that of errno.
[[noreturn]] void throwUnwritten(const std::filesystem::path& file, std::string_view why = {});

}  // namespace perdure
