// Objects of the map as text, JSON and GeoJSON.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "common/types/map.h"
#include "common/types/sensors.h"

namespace perdure::tools {

/// One line for each object, with a header.
std::string toTable(const std::vector<MapObject>& objects);
std::string toText(const MapObject& object);
nlohmann::ordered_json toJson(const MapObject& object);
/// RFC 7946. `anchor`: geographic position of the frame's origin, and yaw of its x axis from east.
/// Without an anchor, the output uses 0°, 0° and "georeferenced": false.
nlohmann::ordered_json toGeoJson(const std::vector<MapObject>& objects,
                                 const std::optional<GeoAnchor>& anchor);

}  // namespace perdure::tools
