// Objects of the map as text, JSON and GeoJSON.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "common/types/map.h"
#include "common/types/sensors.h"

namespace perdure::tools {

/// Returns a header and one line for each object.
std::string toTable(const std::vector<MapObject>& objects);
std::string toText(const MapObject& object);
nlohmann::ordered_json toJson(const MapObject& object);
/// Returns GeoJSON (RFC 7946). `anchor` is the position of the frame's origin on Earth, and the yaw
/// of its x axis from east. If there is no anchor, the origin is at 0°, 0°, and "georeferenced" is
/// false.
nlohmann::ordered_json toGeoJson(const std::vector<MapObject>& objects,
                                 const std::optional<GeoAnchor>& anchor);

}  // namespace perdure::tools
