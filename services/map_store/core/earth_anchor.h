// Where on Earth M lies, as the map's file and settings say it: latitude, longitude, height, yaw,
// in degrees and metres (earth_place.h).
#pragma once

#include <string>
#include <vector>

namespace perdure::map_store {

/// Four numbers that are a place on Earth.
bool isEarthAnchor(const std::vector<double>& numbers);
/// Those of the file's text; none where it is no such place.
std::vector<double> earthAnchorFrom(const std::string& text);

}  // namespace perdure::map_store
