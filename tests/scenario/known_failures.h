// Bars that the filter does not pass yet, of known_failures.csv: how far each may be missed, and
// why. A value worse than that fails; so does one that passes, until its row is gone.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace perdure::test {

struct KnownFailure {
  std::string scene;
  std::string run;  ///< "seeds" 1 to 3 with true poses, "vio", or "recalled"
  std::string bar;  ///< its name
  double tolerated = 0.0;
  std::string why;  ///< with the figures when the row was written
};

/// Throws std::runtime_error with "file:line: what is wrong": the header, the number of fields, a
/// number, an empty field, a bar of a run that is named twice.
std::vector<KnownFailure> readKnownFailures(const std::filesystem::path& file);

/// Those of a run.
std::vector<KnownFailure> knownFailures(const std::vector<KnownFailure>& all,
                                        const std::string& scene, const std::string& run);
/// Of the sources' table.
std::vector<KnownFailure> knownFailures(const std::string& scene, const std::string& run);
std::filesystem::path knownFailuresFile();

}  // namespace perdure::test
