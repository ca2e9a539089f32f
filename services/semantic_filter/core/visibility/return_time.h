// When a hidden thing will be seen again, if the body goes on as it does: the other half of "knows
// that it is hidden" (paper, line 182).
#pragma once

#include <optional>
#include <vector>

#include "services/semantic_filter/core/belief/track.h"
#include "services/semantic_filter/core/measurement/frame.h"

namespace perdure::semantic_filter {

/// How the body goes on.
struct Way {
  RigidTransform step;      ///< T_BB' from one frame to the next
  double seconds = 0.0;     ///< of a step, > 0
  double speed_walk = 0.0;  ///< m/s/√s, by which its velocity wanders
};

/// Seconds after the frame.
struct ReappearanceInterval {
  double expected = 0.0;
  double earliest = 0.0, latest = 0.0;  ///< of nine in ten
};

/// Seconds after the frame in which `hidden`, one of `tracks` at rest, comes out from behind what
/// hides it; nothing where it does not within ten seconds.
std::optional<double> expectedReappearance(const std::vector<Track>& tracks, const Track& hidden,
                                           const FrameInput& now, const Way& way,
                                           const VisibilityParameters& parameters);

/// The same with an interval, at fifteen times the cost: how well it and what hides it are placed,
/// and how the body's velocity wanders.
std::optional<ReappearanceInterval> reappearanceInterval(const std::vector<Track>& tracks,
                                                         const Track& hidden, const FrameInput& now,
                                                         const Way& way,
                                                         const VisibilityParameters& parameters);

}  // namespace perdure::semantic_filter
