// Reappearance time: expected time at which an occluded object is visible again, if the body keeps
// its motion (paper, line 182 and "Occlusion and Memory", which give no method). Derivation:
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
  double speed_walk = 0.0;  ///< m/s per √s, random walk of the velocity
};

/// Seconds after the frame.
struct ReappearanceInterval {
  double expected = 0.0;
  double earliest = 0.0, latest = 0.0;  ///< ends of the 90 % interval
};

/// Returns the seconds after the frame until `hidden`, one of `tracks` at rest, comes out from
/// behind its occluders. Returns nothing if this takes more than ten seconds.
std::optional<double> expectedReappearance(const std::vector<Track>& tracks, const Track& hidden,
                                           const FrameInput& now, const Way& way,
                                           const VisibilityParameters& parameters);

/// Returns the same time with an interval, at fifteen times the cost. The interval includes the
/// errors of the object, of its main occluder, and of the body's velocity.
std::optional<ReappearanceInterval> reappearanceInterval(const std::vector<Track>& tracks,
                                                         const Track& hidden, const FrameInput& now,
                                                         const Way& way,
                                                         const VisibilityParameters& parameters);

}  // namespace perdure::semantic_filter
