// The table digests.csv: the digests of each run's outputs, for each arithmetic.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <tuple>

namespace perdure::test {

/// Digests of the output files, by file name.
using Digests = std::map<std::string, std::string>;

class DigestTable {
 public:
  /// An absent file gives an empty table. Throws std::runtime_error that names an invalid line.
  static DigestTable read(const std::filesystem::path& file);
  void write(const std::filesystem::path& file) const;

  /// Returns an empty map if the run has no digests.
  Digests of(const std::string& arithmetic, const std::string& run) const;
  /// Replaces the digests of the run.
  void put(const std::string& arithmetic, const std::string& run, const Digests& digests);

 private:
  std::map<std::pair<std::string, std::string>, Digests> rows_;  // digests by arithmetic and run
};

/// Returns the first difference of two texts, "line 12: `…`, was `…`", or "" if they are equal.
std::string firstDifference(std::string_view now, std::string_view before);

}  // namespace perdure::test
