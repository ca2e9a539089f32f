// Renders a scene to a dataset folder. The result is deterministic; an interrupted run continues.
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
  bool images = true;       ///< false: ground truth, IMU, speed only; visibility at half resolution
  std::uint64_t every = 1;  ///< renders only each N-th frame
  int threads = 2;
};

struct SimulateProgress {
  std::size_t frame = 0, frames = 0;  ///< completed frames and their total
  std::size_t resumed = 0;            ///< frames from an earlier run
};

/// Returns false if the folder was complete before. Throws StartupError for invalid options, an
/// unknown scene, or a folder with other content. `report` may be empty.
bool simulate(const SimulateOptions& options,
              const std::function<void(const SimulateProgress&)>& report);
/// Renders `scene`; ignores options.scene and options.seed.
bool simulate(const sim::Scene& scene, const SimulateOptions& options,
              const std::function<void(const SimulateProgress&)>& report);

}  // namespace perdure::tools
