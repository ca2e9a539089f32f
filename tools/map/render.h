// Objects of the map as text, JSON and GeoJSON.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "common/types/map.h"
#include "common/types/sensors.h"

namespace perdure::tools {

/// One line an object, with a heading.
std::string toTable(const std::vector<MapObject>& objects);
/// Everything about one object, with standard deviations.
std::string toText(const MapObject& object);
nlohmann::ordered_json toJson(const MapObject& object);
/// RFC 7946. `anchor`: where on Earth the origin of their frame lies, yaw of its x axis from east;
/// without one a declared default of 0°, 0° and "georeferenced": false.
nlohmann::ordered_json toGeoJson(const std::vector<MapObject>& objects,
                                 const std::optional<GeoAnchor>& anchor);

}  // namespace perdure::tools
