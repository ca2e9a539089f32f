// Decides when a track is fitted to its keyframes, and fits all its hypotheses
// (tools/docs/maths/map_fit.md).
#pragma once

#include "services/semantic_filter/core/belief/belief.h"
#include "services/semantic_filter/core/smoothing/keyframes.h"

namespace perdure::semantic_filter {

/// Stores the assigned box as a keyframe if its view is new. Returns whether a fit is due.
bool considerKeyframe(Track& track, const BoxDetection& box, const std::array<bool, 4>& hidden,
                      const FrameContext& frame);
/// Returns the number of new keyframes over the number that makes a fit due. `fresh`: the share
/// of new keyframes that requires a fit.
double refitNeed(const Track& track, double fresh);
struct NetworkEvidence {
  SideEvidence sides;      ///< of keyframes not yet counted; only after a mode search
  ResidualRatio azimuths;  ///< of keyframes that no earlier fit counted
  /// Nats for boxes that enclose outlines, not cuboids, by all keyframes; only if the frame
  /// `estimates_extent`.
  std::optional<double> outline_nats = {};
};
/// Fits the hypotheses and weighs rest against motion. Returns the evidence about the network, if
/// the track is reliable enough.
std::optional<NetworkEvidence> refit(Track& track, const FrameContext& frame);

/// Fits the tracks with the largest refitNeed, and learns noise scales and ground from them.
void refitNeediest(ScratchVector<Track*>& tracks, Belief& belief, const FrameContext& frame);

}  // namespace perdure::semantic_filter
