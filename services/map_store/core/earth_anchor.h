// The position of M on Earth as in file and settings: latitude, longitude, height, yaw.
#pragma once

#include <string>
#include <vector>

namespace perdure::map_store {

/// Whether `numbers` are four numbers that form a valid place on Earth.
bool isEarthAnchor(const std::vector<double>& numbers);
/// Parses the text of the map's file. Returns an empty vector if it is not a valid place.
std::vector<double> earthAnchorFrom(const std::string& text);

}  // namespace perdure::map_store
