// Where a view lies in another one, by points that look alike and lie to each other alike.
// Gravity is known, so position and yaw are sought. Derivation: tools/docs/maths/appearance.md.
#pragma once

#include <cstddef>
#include <optional>

#include "common/mapping/appearance/view.h"
#include "common/mapping/frames/level_pose.h"

namespace perdure::mapping {

struct ViewMatch {
  LevelGaussian T_AB;      ///< of the view that is looked for (B) in the stored one (A)
  std::size_t points = 0;  ///< that agree
  /// Against as many agreeing by chance, in nats: minus the logarithm of the expected number of
  /// such agreements (Desolneux, Moisan, Morel 2000, number of false alarms).
  double nats = 0.0;
};

/// Returns the best way, whether good enough or not; nothing where less than four points agree.
std::optional<ViewMatch> matchViews(const View& stored, const View& seen);

}  // namespace perdure::mapping
