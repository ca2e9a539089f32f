// The clips of the suite: real motion with rendered images where ../shared/data is, and clips of
// the project's own simulator. Each belongs to one of two halves, chosen before anything was run.
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
  std::string what;  ///< what is particular about it
  /// Folder with cam0.mkv, mav0 and gt_tum.txt; empty where the clip is simulated.
  std::filesystem::path real = {};
  /// Of a real clip: the IMU is simulated along the truth, so that it agrees with the images.
  bool imu_fits = false;
  std::function<sim::Scene(const sim::SceneOptions&, unsigned draw)> make = {};
  bool rolling_shutter = false;
};

/// All of them, whether their data is there or not. `data`: ../shared/data.
std::vector<Clip> allClips(const std::filesystem::path& data);

/// Makes the clip's folder under `cache` where it is not there yet: a EuRoC folder that
/// replay::Dataset reads. Nothing where the data is absent. `draw`: of a simulated clip, other than
/// 0 for the same with other looks and sensors. `progress`: a share of the work done.
std::optional<std::filesystem::path> prepare(const Clip& clip, const std::filesystem::path& cache,
                                             unsigned draw,
                                             const std::function<void(double)>& progress);

}  // namespace perdure::bench
