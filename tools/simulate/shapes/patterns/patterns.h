// Content of the textures, as linear RGB texels that tile.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "tools/simulate/shapes/texture.h"

namespace perdure::tools::shapes {

/// Row by row, size × size.
std::vector<Eigen::Vector3f> paintPattern(TextureKind kind, std::uint64_t seed, int size);

}  // namespace perdure::tools::shapes
