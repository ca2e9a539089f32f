// The graph of a map for people and programs.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "common/types/map.h"

namespace perdure::tools {

/// Text for a reply of kind graph, over the data in the reply, which may be truncated.
std::string toGraphText(const MapReply& graph);
nlohmann::ordered_json toGraphJson(const MapReply& graph);

}  // namespace perdure::tools
