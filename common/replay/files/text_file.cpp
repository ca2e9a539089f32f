#include "common/replay/files/text_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <fstream>

#include "common/base/errors.h"
#include "common/base/files/access.h"

namespace perdure::replay {
namespace {

constexpr std::string_view kBlanks = " \t\r\n\f\v";
constexpr std::size_t kShownComplaints = 10;

template <class Number>
std::optional<Number> parseWhole(std::string_view text) {
  text = trim(text);
  if (text.starts_with('+')) text.remove_prefix(1);
  Number value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

/// Returns the existing neighbour whose name differs from the missing one only in case, Unicode
/// form, blanks at the end or a further ".txt", or "" if there is none.
std::string similarTo(const std::filesystem::path& path) {
  namespace fs = std::filesystem;
  std::error_code error;
  fs::path missing = fs::absolute(path);
  while (missing.has_relative_path() && !fs::exists(missing.parent_path(), error)) {
    missing = missing.parent_path();
  }
  const auto key = [](const fs::path& of) {
    const std::string name = withoutAccents(toLower(of.filename().string()));
    std::string_view stem = trim(name);
    if (stem.ends_with(".txt")) stem.remove_suffix(4);
    return std::string(stem);
  };
  for (const auto& entry : fs::directory_iterator(missing.parent_path(), error)) {
    if (key(entry.path()) == key(missing) && entry.path() != missing) return entry.path().string();
  }
  return {};
}

}  // namespace

std::vector<TextLine> readLines(const std::filesystem::path& path, std::string_view fix) {
  // Opening a pipe waits for its writer, which those of a shell (/dev/fd/63) have.
  const bool pipe = std::filesystem::is_fifo(path) && !path.string().starts_with("/dev/");
  std::ifstream file(pipe ? std::filesystem::path() : path);
  const bool folder = std::filesystem::is_directory(path);
  if (!file || folder) {
    refuseUnreadable(path);
    throw StartupError(ExitCode::kUnavailable, "{} {}; {}", path.c_str(),
                       pipe     ? "is a pipe, not a file"
                       : folder ? "is a folder"
                                : "cannot be read",
                       fix);
  }
  std::vector<TextLine> lines;
  std::string text;
  for (std::size_t number = 1; std::getline(file, text); ++number) {
    if (number == 1 && text.starts_with("\xEF\xBB\xBF")) text.erase(0, 3);
    if (number == 1 && (text.starts_with("\xFF\xFE") || text.starts_with("\xFE\xFF"))) {
      throw StartupError(ExitCode::kData, path.string() + " is UTF-16; save it as UTF-8");
    }
    const auto trimmed = trim(text);
    if (!trimmed.empty()) lines.push_back({number, std::string(trimmed)});
  }
  return lines;
}

void refuseUnreadable(const std::filesystem::path& path) {
  if (const auto why = whyUnreadable(path); !why.empty()) {
    throw StartupError(ExitCode::kUnavailable, why);
  }
}

void throwMissing(const std::filesystem::path& path, std::string_view what, std::string_view fix) {
  refuseUnreadable(path);
  std::error_code error;
  if (const auto target = std::filesystem::read_symlink(path, error); !error) {
    throw StartupError(ExitCode::kUnavailable,
                       "{} is missing: {} is a link to {}, which does not exist; fetch that file "
                       "(for example with git annex get), or correct the link",
                       what, path.c_str(), target.c_str());
  }
  const std::string similar = std::filesystem::exists(path) ? "" : similarTo(path);
  if (!similar.empty()) {
    throw StartupError(
        ExitCode::kUnavailable,
        "{} is missing: {}; {} is there, whose name differs in case, in its Unicode form (composed "
        "or decomposed) or at its end; rename it",
        what, path.c_str(), similar);
  }
  throw StartupError(ExitCode::kUnavailable, "{} is missing: {}; {}", what, path.c_str(), fix);
}

std::string_view trim(std::string_view text) {
  const auto first = text.find_first_not_of(kBlanks);
  if (first == text.npos) return {};
  return text.substr(first, text.find_last_not_of(kBlanks) - first + 1);
}

std::string withoutAccents(std::string_view text) {
  constexpr char32_t kFirstMark = 0x300, kLastMark = 0x36F;  // combining marks
  constexpr char kOther = '\x01';
  std::string result;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto byte = static_cast<unsigned char>(text[i]);
    if (byte >= 0x80 && byte < 0xC0) continue;  // a further byte of a character
    if (byte < 0x80) {
      result += text[i];
      continue;
    }
    const auto next = i + 1 < text.size() ? static_cast<unsigned char>(text[i + 1]) : 0U;
    const char32_t code = byte < 0xE0 ? (byte & 0x1FU) << 6U | (next & 0x3FU) : 0;
    const bool mark = code >= kFirstMark && code <= kLastMark && !result.empty();
    if (mark) {
      result.back() = kOther;
    } else {
      result += kOther;
    }
  }
  return result;
}

std::string toLower(std::string_view text) {
  std::string lower(text);
  for (char& c : lower) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return lower;
}

std::vector<std::string_view> split(std::string_view text, char separator) {
  std::vector<std::string_view> fields;
  while (true) {
    const auto end = separator == ' ' ? text.find_first_of(kBlanks) : text.find(separator);
    const auto field = trim(text.substr(0, end));
    if (separator != ' ' || !field.empty()) fields.push_back(field);
    if (end == text.npos) return fields;
    text.remove_prefix(end + 1);
  }
}

char separatorOf(std::string_view line) {
  for (const char separator : {',', ';'}) {
    if (line.find(separator) != line.npos) return separator;
  }
  return ' ';
}

std::vector<std::string_view> fieldsOf(std::string_view line) {
  auto fields = split(line, separatorOf(line));
  while (fields.size() > 1 && fields.back().empty()) fields.pop_back();
  return fields;
}

std::optional<double> parseNumber(std::string_view text) {
  const auto value = parseWhole<double>(text);
  return value && std::isfinite(*value) ? value : std::nullopt;
}

std::optional<std::int64_t> parseInteger(std::string_view text) {
  return parseWhole<std::int64_t>(text);
}

std::optional<std::vector<double>> parseNumbers(const std::vector<std::string_view>& fields) {
  std::vector<double> values;
  for (const auto field : fields) {
    const auto value = parseNumber(field);
    if (!value) return std::nullopt;
    values.push_back(*value);
  }
  return values;
}

bool isHeader(const std::vector<std::string_view>& fields) {
  const auto is_number = [](std::string_view field) {
    const std::string lower = toLower(field);
    return lower.empty() || lower.find_first_of("0123456789+-.") == 0 || lower == "nan" ||
           lower == "inf" || lower == "infinity";
  };
  return fields.size() > 1 && std::none_of(fields.begin(), fields.end(), is_number);
}

void Complaints::add(std::size_t line, std::string_view what) {
  add(fmt::format("{}:{}: {}", file_.c_str(), line, what));
}

void Complaints::add(std::string_view sentence) {
  if (++count_ > kShownComplaints) return;
  if (!text_.empty()) text_ += '\n';
  text_ += sentence;
}

void Complaints::throwIfAny() const {
  if (count_ == 0) return;
  if (count_ <= kShownComplaints) throw StartupError(ExitCode::kData, text_);
  throw StartupError(ExitCode::kData, "{}\nand {} more", text_, count_ - kShownComplaints);
}

}  // namespace perdure::replay
