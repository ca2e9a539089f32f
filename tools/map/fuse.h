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

/// One input map.
struct FusedFile {
  std::string path;
  std::size_t sessions = 0, objects = 0;  ///< numbers in the file; objects without history
  mapping::FusionReport report;           ///< the first map is the reference of the others
};

struct FuseOutcome {
  std::string out;
  std::vector<FusedFile> files;       ///< in the order in which they were merged
  std::vector<std::string> left_out;  ///< maps without a graph; they cannot be aligned
  std::uint64_t malformed = 0;        ///< number of unreadable rows
  /// Sessions of each part of the map. The parts after the first one are not connected with it yet.
  std::vector<std::vector<WorldId>> parts;
  std::vector<std::size_t> objects_of_part;
  std::size_t objects = 0;  ///< number of objects after fusion, without history

  std::size_t sumOf(std::size_t mapping::FusionReport::*count) const;
  std::size_t objectsBefore() const { return sumOf(&mapping::FusionReport::objects); }
  std::size_t loops() const { return sumOf(&mapping::FusionReport::loops); }
  std::size_t merges() const { return sumOf(&mapping::FusionReport::merges); }
  std::vector<mapping::Change> changes() const;
};

/// Fuses the files of the request and writes `out`, completely or not at all. The order of the
/// files has no effect. Throws StartupError with the fix.
FuseOutcome fuseFiles(const FuseRequest& request);

/// Fuses the newest map of each vehicle on the server with the files of the request. Stores the
/// result on the server as `name`, replacing an older one, and in the file request.out
/// unless that is empty. Leaves out incomplete maps. Throws StartupError with the fix.
FuseOutcome fuseFleet(FuseRequest request, const std::string& url, const std::string& name);

std::string toText(const FuseOutcome& outcome);
std::string toJsonText(const FuseOutcome& outcome);

void addFuseCommand(CLI::App& map);

}  // namespace perdure::tools
