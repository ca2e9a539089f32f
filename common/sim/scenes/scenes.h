// One function per scene: what it proves, and how it is made.
#pragma once

#include <cstdint>

#include "common/sim/scene.h"

namespace perdure::sim {

Scene makeStreet(std::uint64_t seed, const SceneOptions& options);
Scene makeRoom(std::uint64_t seed, const SceneOptions& options);
Scene makeRandom(std::uint64_t seed, const SceneOptions& options);

}  // namespace perdure::sim
