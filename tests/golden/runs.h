// The runs of `perdure pipeline` with recorded digests: scenes of the simulator, and recorded
// drives if their data are beside the sources.
#pragma once

#include <filesystem>
#include <iosfwd>
#include <string>
#include <vector>

namespace perdure::test {

struct GoldenRun {
  std::string name;
  std::string data = {};  ///< the required data folder; "": the simulator's scene of that name
  bool pictures = false;  ///< the results depend on OpenCV's image processing
};
void PrintTo(const GoldenRun& run, std::ostream* out);

const std::vector<GoldenRun>& goldenRuns();
/// Files of a run that have a digest.
const std::vector<std::string>& goldenFiles();

/// Makes the run's input in `folder`, if it needs any, and its outputs in `folder`/now, with the
/// installed programs' commands. Throws std::runtime_error with a program's log.
void produce(const GoldenRun& run, const std::filesystem::path& folder);

}  // namespace perdure::test
