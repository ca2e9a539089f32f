// Text files line by line, numbers out of text, and complaints that name file and line.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace perdure::replay {

struct TextLine {
  std::size_t number = 0;  ///< from 1
  std::string text;        ///< without end of line (LF or CR LF) and surrounding blanks
};

/// Lines that are not empty, without a mark of UTF-8 before the first. UTF-16 is refused (kData).
/// Throws StartupError(kUnavailable) where the file cannot be read; `mend` is the sentence that
/// says what to do about it.
std::vector<TextLine> readLines(const std::filesystem::path& path, std::string_view mend);

/// Throws StartupError(kUnavailable): "`what` is missing: `path`; `mend`".
[[noreturn]] void throwMissing(const std::filesystem::path& path, std::string_view what,
                               std::string_view mend);

std::string_view trim(std::string_view text);
std::string toLower(std::string_view text);
/// Splits at each `separator` (fields are trimmed), or at runs of blanks where it is ' '.
std::vector<std::string_view> split(std::string_view text, char separator);
/// What separates the fields of such a line: a comma where it has one, else a semicolon, else ' '.
char separatorOf(std::string_view line);
/// Fields by that, without the empty ones that separators at the line's end make.
std::vector<std::string_view> fieldsOf(std::string_view line);

/// The whole text as a number; nothing where anything is left over. Infinite and NaN: nothing.
std::optional<double> parseNumber(std::string_view text);
std::optional<std::int64_t> parseInteger(std::string_view text);
/// All fields as finite numbers, or nothing.
std::optional<std::vector<double>> parseNumbers(const std::vector<std::string_view>& fields);
/// Names of columns: there are several fields, and none begins as a number does or is infinite or
/// NaN.
bool isHeader(const std::vector<std::string_view>& fields);

/// Collects what is wrong in one file and throws it all at once: "file:line: what".
class Complaints {
 public:
  explicit Complaints(std::filesystem::path file) : file_(std::move(file)) {}
  void add(std::size_t line, std::string_view what);
  bool empty() const { return count_ == 0; }
  /// Throws StartupError(kData) with the first ten and the number of the rest, if any.
  void throwIfAny() const;

 private:
  std::filesystem::path file_;
  std::string text_;
  std::size_t count_ = 0;
};

}  // namespace perdure::replay
