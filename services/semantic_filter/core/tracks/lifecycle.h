// Tend: prune, confirm, die (paper, "Termination"; DESIGN 5, items 11 and 12). What two tracks
// that are one become: merge.h.
#pragma once

#include <vector>

#include "services/semantic_filter/core/belief/track.h"
#include "services/semantic_filter/core/measurement/frame.h"

namespace perdure::semantic_filter {

/// Whether it surely exists and its best hypothesis knows its place. A claim asks all of them for
/// the place; to be a thing that was known before, its being there is enough.
bool established(const Track& track, const FrameContext& frame);
/// Confirms what surely exists at a known place, takes that back where it is lost, and removes
/// those whose existence has gone, which it returns.
std::vector<Track> confirmAndDelete(std::vector<Track>& tracks, const FrameContext& frame);

}  // namespace perdure::semantic_filter
