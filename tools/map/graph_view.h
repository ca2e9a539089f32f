// The graph of a map as text and JSON.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "common/types/map.h"

namespace perdure::tools {

/// Returns the text for a reply of kind graph. Its figures are those of the data in the reply,
/// which may be truncated.
std::string toGraphText(const MapReply& graph);
nlohmann::ordered_json toGraphJson(const MapReply& graph);

}  // namespace perdure::tools
