// The tools of the MCP server: questions about objects, changes and ground that was not looked at.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "services/gateway/mcp/map.h"

namespace perdure::gateway::mcp {

using Json = nlohmann::ordered_json;

/// Returns the tools of a map with the JSON schemas of their arguments and results, as tools/list
/// sends them.
Json listTools(const Map& map);

/// Returns the result of tools/call. It has isError if the arguments are wrong or the map has no
/// answer. Returns nothing if there is no such tool.
std::optional<Json> callTool(const std::string& name, const Json& arguments, Map& map);

}  // namespace perdure::gateway::mcp
