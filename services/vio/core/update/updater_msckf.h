// Update with points that are used once, because their tracks have ended or their oldest view
// leaves the window (Mourikis & Roumeliotis, ICRA 2007).
#pragma once

#include <vector>

#include "common/base/result.h"
#include "services/vio/core/state/options.h"
#include "services/vio/core/state/state.h"
#include "services/vio/core/tracks/tracks.h"

namespace perdure::vio {

struct UpdateCounts {
  int used = 0, gated = 0;
  int behind = 0;  ///< not triangulated because the rays do not meet in front of the cameras
};

/// Triangulates and gates each track, and updates the state once with all tracks that pass.
/// Failures are counted under their reasons. Fails only if the update fails.
Result<UpdateCounts> updateMsckf(State& state, const std::vector<const Track*>& tracks,
                                 const VisionOptions& options, ReasonCounts& reasons);

}  // namespace perdure::vio
