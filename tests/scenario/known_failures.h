// Bars that the filter does not pass yet, from known_failures.csv, with a tolerance and a reason. A
// value worse than the tolerance fails. A value that passes the bar also fails until its row is
// removed.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace perdure::test {

struct KnownFailure {
  std::string scene;
  std::string run;  ///< "seeds" 1 to 3 with true poses, "vio", or "recalled"
  std::string bar;  ///< name of the bar
  double tolerated = 0.0;
  std::string why;  ///< reason, with the figures at the time of writing
};

/// Throws std::runtime_error with "file:line: cause" for an invalid header, number of fields, or
/// number, for an empty field, or for a repeated bar of a run.
std::vector<KnownFailure> readKnownFailures(const std::filesystem::path& file);

/// Returns the rows of a run.
std::vector<KnownFailure> knownFailures(const std::vector<KnownFailure>& all,
                                        const std::string& scene, const std::string& run);
/// Reads the table of the sources.
std::vector<KnownFailure> knownFailures(const std::string& scene, const std::string& run);
std::filesystem::path knownFailuresFile();

}  // namespace perdure::test
