#include "tests/scenario/known_failures.h"

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <stdexcept>

#include "common/replay/files/text_file.h"

namespace perdure::test {
namespace {

constexpr const char* kHeader = "scene,run,bar,tolerated,why";

/// Splits a line at commas; a quoted field may contain commas, and doubled quotes.
std::vector<std::string> fieldsOf(const std::string& line) {
  std::vector<std::string> fields(1);
  bool quoted = false;
  for (std::size_t i = 0; i < line.size(); ++i) {
    if (line[i] == '"' && quoted && i + 1 < line.size() && line[i + 1] == '"') {
      fields.back() += line[i++];
    } else if (line[i] == '"') {
      quoted = !quoted;
    } else if (line[i] == ',' && !quoted) {
      fields.emplace_back();
    } else {
      fields.back() += line[i];
    }
  }
  return fields;
}

/// Returns the error of a row, or "".
std::string read(const std::string& line, KnownFailure& row) {
  const auto fields = fieldsOf(line);
  if (fields.size() != 5) return "is not " + std::string(kHeader);
  if (std::any_of(fields.begin(), fields.end(), [](const auto& f) { return f.empty(); })) {
    return "a field is empty";
  }
  const auto tolerated = replay::parseNumber(fields[3]);
  if (!tolerated) return "`" + fields[3] + "` is not a number";
  row = {fields[0], fields[1], fields[2], *tolerated, fields[4]};
  return "";
}

bool sameBar(const KnownFailure& a, const KnownFailure& b) {
  return a.scene == b.scene && a.run == b.run && a.bar == b.bar;
}

}  // namespace

std::vector<KnownFailure> readKnownFailures(const std::filesystem::path& file) {
  std::ifstream stream(file);
  std::vector<KnownFailure> rows;
  std::string line;
  int number = 0;
  const auto refuse = [&](const std::string& what) {
    throw std::runtime_error(file.string() + ":" + std::to_string(number) + ": " + what);
  };
  while (std::getline(stream, line)) {
    KnownFailure row;
    if (++number == 1 && line != kHeader) refuse("is not " + std::string(kHeader));
    if (number == 1) continue;
    if (const std::string wrong = read(line, row); !wrong.empty()) refuse(wrong);
    for (const auto& other : rows) {
      if (sameBar(row, other)) refuse("the bar has a row already");
    }
    rows.push_back(row);
  }
  if (number == 0) refuse("is empty or missing");
  return rows;
}

std::vector<KnownFailure> knownFailures(const std::vector<KnownFailure>& all,
                                        const std::string& scene, const std::string& run) {
  std::vector<KnownFailure> rows;
  for (const auto& row : all) {
    if (row.scene == scene && row.run == run) rows.push_back(row);
  }
  return rows;
}

std::vector<KnownFailure> knownFailures(const std::string& scene, const std::string& run) {
  return knownFailures(readKnownFailures(knownFailuresFile()), scene, run);
}

std::filesystem::path knownFailuresFile() {
  const char* root = std::getenv("PERDURE_SOURCE");
  if (root == nullptr) throw std::runtime_error("PERDURE_SOURCE is not set; use ctest");
  return std::filesystem::path(root) / "tests/scenario/known_failures.csv";
}

}  // namespace perdure::test
