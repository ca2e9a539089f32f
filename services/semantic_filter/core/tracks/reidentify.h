// Re-identification: a new track is an old object that was moved, drove off, or was missed for too
// long (paper, line 288; moving objects are out of its scope, line 68). Derivation:
// tools/docs/maths/re_identification.md.
#pragma once

#include <vector>

#include "services/semantic_filter/core/tracks/merge.h"

namespace perdure::semantic_filter {

/// Finds new tracks that are missing ones (confirmed once, now of little existence). The new track
/// gets the id and the past of the missing one; its own id is absorbed. New tracks are established
/// and were first detected when the missing one no longer was. Each of a pair must be nearest to
/// the other.
///
/// A new track that moves must have been at the place of the missing one when that was last
/// detected. A new track at rest must be near, of a class that is carried, and at a place that was
/// in view and empty before. A new track that moves and begins, at once, in the last box of the
/// missing one is the same object, wherever the missing one was believed to be.
std::vector<MergeRecord> reidentifyMoved(std::vector<Track>& tracks, const FrameContext& frame);

/// Keeps deleted tracks that were confirmed once, at rest and of a known class, for
/// `parameters.reidentify_s`. They were deleted by existence or by the loss of every plausible size.
void keepDeleted(std::vector<Track>& recently_deleted, std::vector<Track> deleted, TimePoint now,
                 const TrackParameters& parameters);
/// Gives an established new track the id and the past of a recently deleted one; its own id is
/// absorbed. Both are of one class and overlap in space, or the new track moves and takes over the
/// box of the deleted one. The deleted one was last detected before the new one was first detected.
std::vector<MergeRecord> reidentifyDeleted(std::vector<Track>& tracks,
                                           std::vector<Track>& recently_deleted,
                                           const FrameContext& frame);

}  // namespace perdure::semantic_filter
