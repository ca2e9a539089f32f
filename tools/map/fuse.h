// `perdure map fuse`: merges the maps of several drives and vehicles into one file.
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
  bool force = false;  ///< replaces an existing file
};

/// An input map; the maps are listed in the order in which they were merged.
struct FusedFile {
  std::string path;
  std::size_t sessions = 0, objects = 0;  ///< counts in the file, without history
  mapping::FusionReport report;           ///< the first map is the reference of the others
};

struct FuseOutcome {
  std::string out;
  std::vector<FusedFile> files;
  std::vector<std::string> left_out;  ///< maps without a graph; they cannot be aligned
  std::uint64_t malformed = 0;        ///< unreadable rows
  /// Sessions of each part of the map; the parts after the first one are not yet connected to it.
  std::vector<std::vector<WorldId>> parts;
  std::vector<std::size_t> objects_of_part;
  std::size_t objects = 0;  ///< count after fusion, without history

  std::size_t sumOf(std::size_t mapping::FusionReport::*count) const;
  std::size_t objectsBefore() const { return sumOf(&mapping::FusionReport::objects); }
  std::size_t loops() const { return sumOf(&mapping::FusionReport::loops); }
  std::size_t merges() const { return sumOf(&mapping::FusionReport::merges); }
  std::vector<mapping::Change> changes() const;
};

/// Writes `out` completely or not at all. The order of files has no effect. Throws StartupError.
FuseOutcome fuseFiles(const FuseRequest& request);

/// Merges the newest map of each vehicle with the files of the request and stores it on the server
/// as `name`, replacing an older one. Incomplete uploads are omitted. request.out: also a file; "":
/// none. Throws StartupError.
FuseOutcome fuseFleet(FuseRequest request, const std::string& url, const std::string& name);

std::string toText(const FuseOutcome& outcome);
std::string toJsonText(const FuseOutcome& outcome);

void addFuseCommand(CLI::App& map);

}  // namespace perdure::tools
