// Confirmation and deletion of tracks (paper, "Termination"; Bar-Shalom, Li 2001). Derivation of
// the thresholds: tools/docs/maths/re_identification.md.
#pragma once

#include <vector>

#include "services/semantic_filter/core/belief/track.h"
#include "services/semantic_filter/core/measurement/frame.h"

namespace perdure::semantic_filter {

/// Whether the track surely exists and the position of its best hypothesis is known. This suffices
/// for re-identification. Confirmation also requires that all hypotheses agree on the position.
bool established(const Track& track, const FrameContext& frame);
/// Withdraws the confirmation of moving tracks that are not visible and whose predicted position is
/// too uncertain.
void withdrawLostMovers(std::vector<Track>& tracks, const FrameInput& frame,
                        const Parameters& parameters);
/// Confirms visible tracks that surely exist at a known position. Withdraws the confirmation if
/// existence falls below 0.5 or the deviation exceeds 1.5 confirm_sigma_m. Removes three kinds of
/// tracks: those with an existence below the threshold, which are returned; those with few hits
/// that have been invisible for long; and the least likely ones beyond max_objects.
std::vector<Track> confirmAndDelete(std::vector<Track>& tracks, const FrameContext& frame);

}  // namespace perdure::semantic_filter
