// The update with points that are used once: their tracks have ended, or their oldest view leaves
// the window (Mourikis & Roumeliotis, ICRA 2007).
#pragma once

#include <cstdint>
#include <vector>

#include "common/base/result.h"
#include "services/vio/core/state/options.h"
#include "services/vio/core/state/state.h"
#include "services/vio/core/tracks/tracks.h"

namespace perdure::vio {

struct UpdateCounts {
  int used = 0, not_triangulated = 0, gated = 0;
  int behind = 0;       ///< of those not triangulated: their rays do not meet before the cameras
  bool jumped = false;  ///< the pose was widened
};

/// Triangulates each track, gates it, and updates the state with all that pass at once. Counts
/// failures under their reasons. Fails only where the update itself does.
Result<UpdateCounts> updateMsckf(State& state, const std::vector<const Track*>& tracks,
                                 const VisionOptions& options, ReasonCounts& reasons);

}  // namespace perdure::vio
