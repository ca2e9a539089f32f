// Re-identification: a new track is an old object that was moved, drove off, or was missed for too
// long (paper, line 288; moving objects are out of its scope, line 68). Derivation:
// tools/docs/maths/re_identification.md.
#pragma once

#include <vector>

#include "services/semantic_filter/core/tracks/merge.h"

namespace perdure::semantic_filter {

/// Stores deleted tracks that were confirmed once, for `parameters.reidentify_s`.
void keepDeleted(std::vector<Track>& recently_deleted, std::vector<Track> deleted, TimePoint now,
                 const TrackParameters& parameters);

/// Gives new tracks the ids and first times of missing ones, nearest pairs first, and returns these
/// merges. The derivation lists the cases. If the new track is in the old place, both beliefs are
/// merged; otherwise the belief of the new one is kept.
std::vector<MergeRecord> reidentify(std::vector<Track>& tracks,
                                    std::vector<Track>& recently_deleted,
                                    const FrameContext& frame);

}  // namespace perdure::semantic_filter
