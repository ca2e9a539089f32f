// Initiation of a track from a box that no track explains (tools/docs/maths/initiation.md; paper,
// line 284).
#pragma once

#include <optional>

#include "services/semantic_filter/core/belief/belief.h"
#include "services/semantic_filter/core/tracks/cuboid_fit.h"
#include "services/semantic_filter/core/visibility/occlusion.h"

namespace perdure::semantic_filter {

/// Returns the log ratio of "new object" to clutter for this box, all classes together.
double logInitiationRatio(const BoxDetection& detection, const FrameContext& frame);

/// Returns a track without an id; nothing if too few sides are measured.
std::optional<Track> initiate(const BoxDetection& detection, const std::optional<RangeHint>& range,
                              TimePoint now, const FrameContext& frame);

/// Gives a track a new state and shape from a box assigned to it. `pmf`: of the track before it
/// lost its hypotheses. Returns false, and changes nothing, if the box does not determine a track.
bool reinitialise(Track& track, const ClassNumbers& pmf, const BoxDetection& detection,
                  const std::optional<RangeHint>& range, const FrameContext& frame);

/// Adds tracks from the boxes that no track explains. `explained`: Association::explained.
void initiateTracks(Belief& belief, const ScratchVector<TrackVisibility>& visibilities,
                    const Eigen::VectorXd& explained, const FrameInput& input,
                    const FrameContext& frame, IdBook& ids);

}  // namespace perdure::semantic_filter
