// One run of the simulator: a scene by name, drawn frame by frame into a folder that the rest of
// Perdure reads as a dataset. Resumable; the same options give the same bytes.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>

#include "common/sim/scene.h"
#include "tools/simulate/writer.h"

namespace perdure::tools {

struct SimulateOptions {
  std::string scene;
  std::uint64_t seed = 1;
  std::filesystem::path out;
  sim::SceneOptions world;
  ImageFormat format = ImageFormat::kPng;
  bool images = true;       ///< false: truth, IMU and speed only; visibility at half the resolution
  std::uint64_t every = 1;  ///< draw each so-many-th frame only
  int threads = 2;
};

struct SimulateProgress {
  std::size_t frame = 0, frames = 0;  ///< done, to do
  std::size_t resumed = 0;            ///< of those done, by an earlier run
};

/// False where the folder was complete already. Throws StartupError for options that make no sense,
/// an unknown scene, and a folder that holds something else. `report` may be empty.
bool simulate(const SimulateOptions& options,
              const std::function<void(const SimulateProgress&)>& report);
/// The same of a scene that the caller made; options.scene and options.seed do not count, and
/// options.world must be those with which it was made.
bool simulate(const sim::Scene& scene, const SimulateOptions& options,
              const std::function<void(const SimulateProgress&)>& report);

}  // namespace perdure::tools
