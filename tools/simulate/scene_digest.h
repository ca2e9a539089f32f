// Computes a digest of a scene. It identifies the content of a folder, because scenes of equal name
// may differ.
#pragma once

#include <cstdint>

#include "common/sim/scene.h"

namespace perdure::tools {

/// The digest of objects, scenery, light, sensors, and the poses at each second.
std::uint64_t digestOf(const sim::Scene& scene);

}  // namespace perdure::tools
