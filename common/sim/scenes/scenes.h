// The construction of each scene: one function per scene.
#pragma once

#include <cstdint>

#include "common/sim/scene.h"

namespace perdure::sim {

Scene makeStreet(std::uint64_t seed, const SceneOptions& options);
Scene makeLap(std::uint64_t seed, const SceneOptions& options);
Scene makeRoom(std::uint64_t seed, const SceneOptions& options);
Scene makeToy(std::uint64_t seed, const SceneOptions& options);
Scene makeOcclusion(std::uint64_t seed, const SceneOptions& options);
Scene makeVanish(std::uint64_t seed, const SceneOptions& options);
Scene makeRow(std::uint64_t seed, const SceneOptions& options);
Scene makeRoll(std::uint64_t seed, const SceneOptions& options);
Scene makeStill(std::uint64_t seed, const SceneOptions& options);
Scene makeStraight(std::uint64_t seed, const SceneOptions& options);
Scene makeTraffic(std::uint64_t seed, const SceneOptions& options);
Scene makeTown(std::uint64_t seed, const SceneOptions& options);
Scene makeSuburb(std::uint64_t seed, const SceneOptions& options);
Scene makeBlocks(std::uint64_t seed, const SceneOptions& options);
Scene makeKilometre(std::uint64_t seed, const SceneOptions& options);
Scene makeRandom(std::uint64_t seed, const SceneOptions& options);

}  // namespace perdure::sim
