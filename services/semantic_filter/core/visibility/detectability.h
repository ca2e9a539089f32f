// What makes the detection probability of one object differ from that of its class: something that is
// not on the map may hide it, and from some views it is seldom found.
#pragma once

#include "services/semantic_filter/core/belief/track.h"
#include "services/semantic_filter/core/measurement/frame.h"

namespace perdure::semantic_filter {

/// By what P_D and what is visible are to be multiplied: what is screened is not found, what is
/// elusive seldom.
double shareFound(const Object& object, double elusive_found);

/// P_D of a class for an instance of this size in pixels (√ of its box's area), fully visible.
double detectionProbability(const ClassPrior& prior, double size_px, const FrameContext& frame);

/// P_D of a hypothesis: what is of no known class and looks like one is found as often as those of that
/// class.
double foundAs(const Hypothesis& hypothesis, const Object& object, double size_px, const FrameContext& frame);
/// How often the object is found from here, beside P_D.
double rateOf(const Object& object, const FrameContext& frame);

/// What may hide it from elsewhere is not known until it is seen from there.
void predictScreen(Object& object, const ViewWalk& walk);

/// What a look says of why it did not show the object. `mean_A`: of A over the hypotheses.
void hearFromHere(Object& object, double mean_A, double elusive_found);

}  // namespace perdure::semantic_filter
