// Confirmation and deletion of tracks (paper, "Termination");
// tools/docs/maths/re_identification.md.
#pragma once

#include <vector>

#include "services/semantic_filter/core/belief/track.h"
#include "services/semantic_filter/core/measurement/frame.h"

namespace perdure::semantic_filter {

/// Whether the track surely exists and its best hypothesis is placed, as re-identification needs.
bool established(const Track& track, const FrameContext& frame);
/// Withdraws the confirmation of unseen movers whose place is no longer known.
void withdrawLostMovers(std::vector<Track>& tracks, const FrameInput& frame,
                        const Parameters& parameters);
/// Confirms tracks at a known place. Removes and returns those below the threshold.
std::vector<Track> confirmAndDelete(std::vector<Track>& tracks, const FrameContext& frame);

}  // namespace perdure::semantic_filter
