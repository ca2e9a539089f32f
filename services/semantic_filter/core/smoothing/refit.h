// The verb "smooth": an track's hypotheses again from all its remembered batch; which mode of yaw
// it is, and whether it moves.
#pragma once

#include "services/semantic_filter/core/belief/belief.h"
#include "services/semantic_filter/core/smoothing/keyframes.h"

namespace perdure::semantic_filter {

/// Remembers this box of the track's where it shows something new. Whether the track is then to
/// be map_fit.
bool considerKeyframe(Track& track, const BoxDetection& box, const std::array<bool, 4>& hidden,
                      const FrameContext& frame);
/// How much there is to gain, where `fresh` is the share of new batch that is waited for: 1 and
/// more is worth it.
double refitNeed(const Track& track, double fresh);
/// What the fit of a thing leaves over of its batch.
struct ResidualRatios {
  ResidualRatio sides, azimuths;
};
/// Smooths the track's hypotheses and weighs within each class whether it moves. Of a thing that
/// surely stands, what is left over of the batch that are new.
std::optional<ResidualRatios> refit(Track& track, const FrameContext& frame);

/// Smooths the tracks that need it most: as many as a frame has time for; the others wait.
void refitNeediest(std::vector<Track*>& tracks, Belief& belief, const FrameContext& frame);

}  // namespace perdure::semantic_filter
