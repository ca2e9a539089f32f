// Points that live in the state: their delayed initialisation from a full track, and their update
// with the newest image (Li & Mourikis, RSS 2012: hybrid MSCKF / EKF-SLAM).
#pragma once

#include "services/vio/core/updater_msckf.h"

namespace perdure::vio {

/// Updates the state's points with what the newest clone sees of them. A point whose innovation
/// fails the gate three times in a row, or that lies behind the camera, leaves the state.
Result<UpdateCounts> updateSlam(State& state, const FeatureDatabase& database,
                                const VisionOptions& options, ReasonCounts& reasons);

/// Puts the track's point into the state, and uses all its views. Fails with the reason of
/// triangulation, "slam_gated", or that of the update.
Result<void> initialisePoint(State& state, const Track& track, const VisionOptions& options);

}  // namespace perdure::vio
