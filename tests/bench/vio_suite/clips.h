// The clips of the suite: real motion with rendered images if ../shared/data exists, and clips of
// the project's own simulator. Each clip belongs to one of two halves, which were chosen before the
// first run.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "common/sim/scene.h"

namespace perdure::bench {

enum class Half { kTuned, kJudged };

struct Clip {
  std::string name;
  Half half = Half::kTuned;
  std::string what;  ///< description of the clip
  /// Folder with cam0.mkv, mav0 and gt_tum.txt; empty for a simulated clip.
  std::filesystem::path real = {};
  /// For a real clip: the IMU is simulated along the truth, so that it agrees with the images.
  bool imu_fits = false;
  std::function<sim::Scene(const sim::SceneOptions&, unsigned draw)> make = {};
  bool rolling_shutter = false;
};

/// Returns all clips, even if their data is missing. `data` is ../shared/data.
std::vector<Clip> allClips(const std::filesystem::path& data);

/// Makes the clip's folder under `cache` if it does not exist: a EuRoC folder that replay::Dataset
/// reads. Returns nothing if the data is missing. A `draw` other than 0 gives a simulated clip
/// another appearance and other sensor errors. `progress` receives the share of the work done.
std::optional<std::filesystem::path> prepare(const Clip& clip, const std::filesystem::path& cache,
                                             unsigned draw,
                                             const std::function<void(double)>& progress);

}  // namespace perdure::bench
