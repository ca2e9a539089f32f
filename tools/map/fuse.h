// `perdure map fuse`: maps of several drives and vehicles as one file.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/mapping/fusion/map_fusion.h"

namespace CLI {
class App;
}

namespace perdure::tools {

struct FuseRequest {
  std::vector<std::string> files;
  std::string out;
  bool force = false;  ///< replaces what is there
};

/// A map that was given, in the order in which they were brought together.
struct FusedFile {
  std::string path;
  std::size_t sessions = 0, objects = 0;  ///< in the file; history not counted
  mapping::FusionReport report;           ///< the first one is what the rest was brought to
};

struct FuseOutcome {
  std::string out;
  std::vector<FusedFile> files;
  std::vector<std::string> left_out;  ///< maps without a graph: they cannot be aligned
  std::uint64_t malformed = 0;        ///< rows that could not be read
  /// Sessions by the part of the map that they belong to; those of all but the first part join
  /// nothing yet.
  std::vector<std::vector<WorldId>> parts;
  std::vector<std::size_t> objects_of_part;
  std::size_t objects = 0;  ///< afterwards, history not counted

  std::size_t objectsBefore() const, loops() const, merges() const;
  std::vector<mapping::Change> changes() const;
};

/// Reads the files and writes `out`: whole, or not at all. The order of the files does not matter.
/// Throws StartupError with the mend.
FuseOutcome fuseFiles(const FuseRequest& request);

std::string toText(const FuseOutcome& outcome);
std::string toJsonText(const FuseOutcome& outcome);

void addFuseCommand(CLI::App& map);

}  // namespace perdure::tools
