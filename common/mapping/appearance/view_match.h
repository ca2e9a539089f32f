// Estimates the pose of one view in another from points with similar descriptors and consistent
// positions. Gravity is known, so only position and yaw are estimated. Derivation:
// tools/docs/maths/appearance.md.
#pragma once

#include <cstddef>
#include <optional>

#include "common/mapping/appearance/view.h"
#include "common/mapping/frames/level_pose.h"

namespace perdure::mapping {

struct ViewMatch {
  LevelGaussian T_AB;      ///< pose of the observed view (B) in the stored view (A)
  std::size_t points = 0;  ///< number of point pairs that agree with this pose
  /// Evidence against agreement by chance, in nats: minus the logarithm of the expected number of
  /// such agreements (Desolneux, Moisan, Morel 2000, number of false alarms).
  double nats = 0.0;
};

/// Returns the best pose of `seen` in `stored`, even if its evidence is weak. Returns nothing if
/// fewer than four points agree.
std::optional<ViewMatch> matchViews(const View& stored, const View& seen);

}  // namespace perdure::mapping
