// Reads text files line by line, parses numbers, and reports errors with file and line.
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
  std::size_t number = 0;  ///< line number, counted from 1
  std::string text;        ///< text without line end (LF or CR LF) and surrounding blanks
};

/// Non-empty lines, without a UTF-8 byte order mark. UTF-16 is refused (kData). Throws
/// StartupError(kUnavailable) if the file cannot be read; the message ends with `fix`.
std::vector<TextLine> readLines(const std::filesystem::path& path, std::string_view fix);

/// Throws StartupError(kUnavailable) if the permissions of the file or of a folder above forbid
/// reading it.
void refuseUnreadable(const std::filesystem::path& path);

/// The text with one character in place of each one beyond ASCII, so that composed and decomposed
/// Unicode (é as one code point, or as e and an accent) are equal.
std::string withoutAccents(std::string_view text);

/// Throws StartupError(kUnavailable): "`what` is missing: `path`; `fix`". If a
/// file exists whose name differs only in case or Unicode form, the message names it instead.
[[noreturn]] void throwMissing(const std::filesystem::path& path, std::string_view what,
                               std::string_view fix);

std::string_view trim(std::string_view text);
std::string toLower(std::string_view text);
/// Splits at each `separator` and trims the fields. For ' ' it splits at runs of blanks.
std::vector<std::string_view> split(std::string_view text, char separator);
/// The separator of the fields in a line: comma if present, else semicolon, else ' '.
char separatorOf(std::string_view line);
/// Fields of a line, split by separatorOf(), without empty fields at the end.
std::vector<std::string_view> fieldsOf(std::string_view line);

/// The whole text as a finite number. Returns nothing if characters remain, or for infinity and
/// NaN.
std::optional<double> parseNumber(std::string_view text);
std::optional<std::int64_t> parseInteger(std::string_view text);
/// Parses all fields as finite numbers. Returns nothing if one is not.
std::optional<std::vector<double>> parseNumbers(const std::vector<std::string_view>& fields);
/// Returns true for column names: there are several fields, and none is infinite, NaN, or begins
/// like a number.
bool isHeader(const std::vector<std::string_view>& fields);

/// Collects errors and throws them together.
class Complaints {
 public:
  explicit Complaints(std::filesystem::path file = {}) : file_(std::move(file)) {}
  /// Adds the error "file:line: what".
  void add(std::size_t line, std::string_view what);
  void add(std::string_view sentence);
  /// Throws StartupError(kData) with the first ten errors and the number of the others, if any.
  void throwIfAny() const;

 private:
  std::filesystem::path file_;
  std::string text_;
  std::size_t count_ = 0;
};

}  // namespace perdure::replay
