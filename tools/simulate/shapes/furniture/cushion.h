// Adds cushions, the basic parts of couches and armchairs.
#pragma once

#include "tools/simulate/shapes/mesh_builder.h"

namespace perdure::tools::shapes {

/// Adds a box with edges rounded by `round` (metres, less than half of each side).
void addCushion(MeshBuilder& builder, const Vec3& low, const Vec3& high, float round, int material);

}  // namespace perdure::tools::shapes
