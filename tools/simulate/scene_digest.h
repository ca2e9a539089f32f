// A number that differs where two scenes do: what a folder was made from, beyond its scene's name.
#pragma once

#include <cstdint>

#include "common/sim/scene.h"

namespace perdure::tools {

/// Over objects, scenery, light, sensors, and the motions at each second.
std::uint64_t digestOf(const sim::Scene& scene);

}  // namespace perdure::tools
