// Stores the simulator's scenes for the tests that use them, because making a scene takes longer
// than a run.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>

namespace perdure::test {

/// A scene; `seconds` is its duration, 0: the scene's own.
struct SceneName {
  std::string scene;
  std::uint64_t seed = 1;
  double seconds = 0.0, rate_hz = 10.0;
  bool images = false;
};

/// Returns the scene's folder in the build folder above this program. `make` writes the scene into
/// the folder that it is given, if the folder does not contain it already; images are JPEG. Other
/// processes that need the same scene wait meanwhile. Scenes from other versions of the simulator's
/// sources are removed. $PERDURE_SOURCE is the root of the sources.
std::filesystem::path cachedScene(const SceneName& name,
                                  const std::function<void(const std::filesystem::path&)>& make);

}  // namespace perdure::test
