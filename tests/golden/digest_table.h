// digests.csv: what the outputs of each run are, on machines of each arithmetic.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <tuple>

namespace perdure::test {

/// By file.
using Digests = std::map<std::string, std::string>;

class DigestTable {
 public:
  /// An absent file is an empty table. Throws std::runtime_error that names a line that is wrong.
  static DigestTable read(const std::filesystem::path& file);
  void write(const std::filesystem::path& file) const;

  /// Empty where there are none.
  Digests of(const std::string& arithmetic, const std::string& run) const;
  /// In place of those that the run had.
  void put(const std::string& arithmetic, const std::string& run, const Digests& digests);

 private:
  std::map<std::pair<std::string, std::string>, Digests> rows_;  // by arithmetic and run
};

/// Where two texts part: "line 12: `…`, was `…`"; empty where they are the same.
std::string firstDifference(std::string_view now, std::string_view before);

}  // namespace perdure::test
