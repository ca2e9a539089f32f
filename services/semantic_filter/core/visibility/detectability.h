// What makes the detection probability of one track differ from that of its class: something that
// is not on the map may hide it, and from some views it is seldom found.
#pragma once

#include "services/semantic_filter/core/belief/track.h"
#include "services/semantic_filter/core/measurement/frame.h"

namespace perdure::semantic_filter {

/// By what P_D and what is visible are to be multiplied: what is unmapped_occluder is not found,
/// what is hard_to_detect seldom.
double detectableShare(const Track& track, double hard_detection_share);

/// P_D of a class for an instance of this size in pixels (√ of its box's area), fully visible.
double detectionProbability(const ClassPrior& prior, double size_px, const FrameContext& frame);

/// P_D of a hypothesis: what is of no known class and looks like one is found as often as those of
/// that class.
double detectionProbabilityOf(const Hypothesis& hypothesis, const Track& track, double size_px,
                              const FrameContext& frame);
/// How often the track is found from here, beside P_D.
double detectionRateFactor(const Track& track, const FrameContext& frame);

/// What may hide it from elsewhere is not known until it is seen from there.
void predictDetectability(Track& track, const ViewWalk& walk);

/// What a score says of why it did not show the track. `mean_A`: of A over the hypotheses.
void updateDetectability(Track& track, double mean_A, double hard_detection_share);

}  // namespace perdure::semantic_filter
