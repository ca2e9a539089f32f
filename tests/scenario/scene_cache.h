// Where the simulator's scenes are kept for the tests that run over them: making one costs more
// than a run.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

namespace perdure::test {

/// A scene in its own length (`seconds` 0) or another.
struct SceneName {
  std::string scene;
  std::uint64_t seed = 1;
  double seconds = 0.0, rate_hz = 10.0;
  bool images = false;
};

/// The scene's folder in the build folder above this program, whether or not it was made already.
/// Images are JPEG. Scenes of other sources of the simulator than these are removed.
/// $PERDURE_SOURCE is the root of the sources.
std::filesystem::path cachedScene(const SceneName& name);

}  // namespace perdure::test
