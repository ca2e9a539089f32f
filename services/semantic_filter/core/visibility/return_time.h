// Reappearance time: when an occluded object is expected to be visible again if the body keeps its
// motion (paper, line 182 and "Occlusion and Memory"; the method is ours). Derivation:
// tools/docs/maths/reappearance_time.md.
#pragma once

#include <optional>
#include <vector>

#include "services/semantic_filter/core/belief/track.h"
#include "services/semantic_filter/core/measurement/frame.h"

namespace perdure::semantic_filter {

struct Way {
  RigidTransform step;      ///< T_BB': motion from one frame to the next
  double seconds = 0.0;     ///< duration of a step, > 0
  double speed_walk = 0.0;  ///< m/s per √s, how much the velocity wanders
};

/// Seconds after the frame.
struct ReappearanceInterval {
  double expected = 0.0;
  double earliest = 0.0, latest = 0.0;  ///< interval of nine in ten
};

/// Returns the seconds after the frame until `hidden`, one of `tracks` at rest, comes out from
/// behind its occluders. Returns nothing if it does not within ten seconds.
std::optional<double> expectedReappearance(const std::vector<Track>& tracks, const Track& hidden,
                                           const FrameInput& now, const Way& way,
                                           const VisibilityParameters& parameters);

/// The same with an interval, at fifteen times the cost. The interval includes the errors of the
/// object's place, of its main occluder, and of the body's velocity.
std::optional<ReappearanceInterval> reappearanceInterval(const std::vector<Track>& tracks,
                                                         const Track& hidden, const FrameInput& now,
                                                         const Way& way,
                                                         const VisibilityParameters& parameters);

}  // namespace perdure::semantic_filter
