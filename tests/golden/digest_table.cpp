#include "tests/golden/digest_table.h"

#include <algorithm>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <vector>

namespace perdure::test {
namespace {

constexpr std::string_view kHeader = "arithmetic,run,file,digest";

/// Removes and returns the first line of `text`; returns "(the end)" after the last line.
std::string_view takeLine(std::string_view& text) {
  if (text.empty()) return "(the end)";
  const std::string_view line = text.substr(0, text.find('\n'));
  text.remove_prefix(std::min(line.size() + 1, text.size()));
  return line;
}

std::string shortened(std::string_view line) {
  constexpr std::size_t kMost = 160;
  return line.size() <= kMost ? std::string(line) : std::string(line.substr(0, kMost)) + "…";
}

/// Returns how many leading characters of a line to omit, so that the difference is visible.
std::size_t sameBefore(std::string_view a, std::string_view b) {
  constexpr std::size_t kShown = 40;
  const auto differs = std::mismatch(a.begin(), a.end(), b.begin(), b.end()).first;
  const auto same = static_cast<std::size_t>(differs - a.begin());
  return same > kShown ? same - kShown : 0;
}

std::vector<std::string> fieldsOf(const std::string& line) {
  std::vector<std::string> fields;
  std::istringstream stream(line);
  for (std::string field; std::getline(stream, field, ',');) fields.push_back(field);
  return fields;
}

}  // namespace

DigestTable DigestTable::read(const std::filesystem::path& file) {
  DigestTable table;
  std::ifstream stream(file);
  std::string line;
  for (int number = 1; std::getline(stream, line); ++number) {
    const auto fields = fieldsOf(line);
    const bool right = number == 1 ? line == kHeader : fields.size() == 4;
    if (!right) {
      throw std::runtime_error(file.string() + ":" + std::to_string(number) + ": is not `" +
                               std::string(kHeader) + "`");
    }
    if (number > 1) table.rows_[{fields[0], fields[1]}][fields[2]] = fields[3];
  }
  return table;
}

void DigestTable::write(const std::filesystem::path& file) const {
  std::ofstream stream(file, std::ios::trunc);
  stream << kHeader << '\n';
  for (const auto& [key, digests] : rows_) {
    for (const auto& [name, value] : digests) {
      stream << key.first << ',' << key.second << ',' << name << ',' << value << '\n';
    }
  }
  if (!stream.flush()) throw std::runtime_error(file.string() + " cannot be written");
}

Digests DigestTable::of(const std::string& arithmetic, const std::string& run) const {
  const auto found = rows_.find({arithmetic, run});
  return found == rows_.end() ? Digests() : found->second;
}

void DigestTable::put(const std::string& arithmetic, const std::string& run,
                      const Digests& digests) {
  rows_[{arithmetic, run}] = digests;
}

std::string firstDifference(std::string_view now, std::string_view before) {
  const bool same_end = now.ends_with('\n') == before.ends_with('\n');
  for (int number = 1; now != before; ++number) {
    const std::string_view a = takeLine(now), b = takeLine(before);
    if (a == b) continue;
    const std::size_t same = sameBefore(a, b);
    const std::string from = same == 0 ? "" : ", from character " + std::to_string(same + 1);
    return "line " + std::to_string(number) + from + ": `" + shortened(a.substr(same)) +
           "`, was `" + shortened(b.substr(same)) + "`";
  }
  return same_end ? "" : "the end of the last line";
}

}  // namespace perdure::test
