// Converts a mesh to binary glTF 2.0 for the page: one primitive in a box of 1 × 1 × 1 about the
// origin, with COLOR_0 instead of materials.
#pragma once

#include <string>

#include "tools/simulate/shapes/mesh.h"

namespace perdure::tools::viewer {

/// COLOR_0 is the brightness of each part, relative to the one with the largest area, which is 1.
/// The page multiplies it by the colour of the class.
std::string glbOf(const Mesh& mesh);

}  // namespace perdure::tools::viewer
