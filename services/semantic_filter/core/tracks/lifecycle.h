// Confirmation and deletion of tracks (paper, "Termination"; Bar-Shalom, Li 2001). Derivation of
// the thresholds: tools/docs/maths/re_identification.md.
#pragma once

#include <vector>

#include "services/semantic_filter/core/belief/track.h"
#include "services/semantic_filter/core/measurement/frame.h"

namespace perdure::semantic_filter {

/// Whether the track surely exists and its best hypothesis is placed. Re-identification needs no
/// more; confirmation also needs that all hypotheses agree on the place.
bool established(const Track& track, const FrameContext& frame);
/// Withdraws the confirmation of tracks that were not seen since they moved on to a place that is
/// no longer known.
void withdrawLostMovers(std::vector<Track>& tracks, const FrameInput& frame,
                        const Parameters& parameters);
/// Confirms visible tracks that surely exist at a known place, and withdraws the confirmation if
/// either is lost. Removes and returns the tracks whose existence fell below the threshold.
std::vector<Track> confirmAndDelete(std::vector<Track>& tracks, const FrameContext& frame);

}  // namespace perdure::semantic_filter
