// map.png: the way that the body took and the objects of the map, seen from above.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <vector>

#include "common/types/objects.h"

namespace perdure::tools {

/// Draws W with x to the right and y up: footprints with 2σ ellipses, ids and classes, a scale bar.
/// Nothing is drawn where there is neither a path nor an object. False: the file was not written.
bool drawMap(const std::vector<Eigen::Vector3d>& path, const std::vector<ObjectBelief>& objects,
             const std::filesystem::path& file);

}  // namespace perdure::tools
