// A map's file as the MCP server asks it.
#pragma once

#include <optional>
#include <string>

#include "services/gateway/mcp/map.h"
#include "tools/map/map_source.h"

namespace perdure::tools {

class FileMap : public gateway::mcp::Map {
 public:
  /// `path`: a map's file, or a folder with map.sqlite. Throws StartupError if it is not readable.
  explicit FileMap(const std::string& path);

  /// Reads the file again, because a service may write it.
  gateway::mcp::State begin() override;
  MapReply ask(const MapQuery& query) override;

 private:
  std::string path_;
  std::optional<MapFile> file_;
};

}  // namespace perdure::tools
