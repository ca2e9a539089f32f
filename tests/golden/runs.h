// The runs of `perdure pipeline` whose outputs are kept as digests: scenes of the simulator, and
// recorded drives where their data are beside the sources.
#pragma once

#include <filesystem>
#include <iosfwd>
#include <string>
#include <vector>

namespace perdure::test {

struct GoldenRun {
  std::string name;
  std::string data = {};  ///< the folder that it needs; "": the simulator's scene of that name
  bool pictures = false;  ///< its results depend on what OpenCV makes of pictures
  int status = 0;         ///< of the pipeline: 65 where the map has to stay empty
};
void PrintTo(const GoldenRun& run, std::ostream* out);

const std::vector<GoldenRun>& goldenRuns();
/// Files of a run that have a digest.
const std::vector<std::string>& goldenFiles();

/// Makes the run's input in `folder`, where it needs any, and its outputs in `folder`/now, by the
/// programs that users have. Throws std::runtime_error with what a program said.
void produce(const GoldenRun& run, const std::filesystem::path& folder);

}  // namespace perdure::test
