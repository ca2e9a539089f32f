// The graph of a map for people and programs: length and uncertainty of the trajectory, and the
// evidence for its loops.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "common/types/map.h"

namespace perdure::tools {

/// Text for a reply of kind graph. The figures cover only the data in the reply; the text states if
/// these are truncated.
std::string toGraphText(const MapReply& graph);
nlohmann::ordered_json toGraphJson(const MapReply& graph);

}  // namespace perdure::tools
