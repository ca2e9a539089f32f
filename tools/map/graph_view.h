// The graph of a map for people and programs: how long the way is, how well it is known, and on
// what its loops rest.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "common/types/map.h"

namespace perdure::tools {

/// Of an answer of kind graph. Figures of what it tells alone: where it is truncated the text says
/// so.
std::string toGraphText(const MapReply& graph);
nlohmann::ordered_json toGraphJson(const MapReply& graph);

}  // namespace perdure::tools
