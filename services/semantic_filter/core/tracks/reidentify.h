// A newcomer that is no new thing: one that was moved, or drove off, while nobody could
// applyCorrection it is missing where it stood, and a newcomer of its class is near by (DESIGN 5,
// item 11); one that was believed gone because the network missed it again and again is found where
// it was.
#pragma once

#include <vector>

#include "services/semantic_filter/core/tracks/merge.h"

namespace perdure::semantic_filter {

/// Gives the newcomer the id and the past of what is missing; its own id is absorbed. Newcomers are
/// established and were first seen when the other was seen no more. One that moves must have been
/// where the other stood when that was last seen; one that stands is of a class that is carried,
/// near by, at a place that was looked at before, and empty. Wherever the other was believed to be,
/// what drives in the box that it was last seen in, at once, is it. Each is taken with the nearest
/// that would have it, too.
std::vector<MergeRecord> reidentifyMoved(std::vector<Track>& tracks, const FrameContext& frame);

/// Keeps what was claimed at rest and is now believed gone, or has lost its shape, for `return_s`
/// from then on.
void keepDeleted(std::vector<Track>& gone, std::vector<Track> deleted, TimePoint now,
                 const TrackParameters& parameters);
/// Gives an established newcomer the id and the past of what is gone, of its class and in its
/// place, and was not seen since the newcomer was; or that it takes over the box of, and drives.
/// The newcomer's own id is absorbed.
std::vector<MergeRecord> reidentifyDeleted(std::vector<Track>& tracks, std::vector<Track>& gone,
                                           const FrameContext& frame);

}  // namespace perdure::semantic_filter
