// A digest that differs between different scenes; it identifies the content of a folder beyond the
// scene's name.
#pragma once

#include <cstdint>

#include "common/sim/scene.h"

namespace perdure::tools {

/// Covers objects, scenery, light, sensors, and the motions at each second.
std::uint64_t digestOf(const sim::Scene& scene);

}  // namespace perdure::tools
