// The position of M on Earth in the map's file and in the configuration: latitude, longitude,
// height and yaw, in degrees and metres (earth_place.h).
#pragma once

#include <string>
#include <vector>

namespace perdure::map_store {

/// Whether `numbers` are four numbers that describe a valid place on Earth.
bool isEarthAnchor(const std::vector<double>& numbers);
/// Parses the text of the map's file. Returns an empty vector if it is not a valid place.
std::vector<double> earthAnchorFrom(const std::string& text);

}  // namespace perdure::map_store
