// Detectability: causes of a different P_D at one track (Mahler 2007; not in the paper).
// Derivation: tools/docs/maths/detectability.md.
#pragma once

#include "services/semantic_filter/core/belief/track.h"
#include "services/semantic_filter/core/measurement/frame.h"

namespace perdure::semantic_filter {

/// Returns the factor on v P_D. Behind an unmapped occluder the object is not detected. For an
/// object that is hard to detect, the share `hard_detection_share` of P_D remains.
double detectableShare(const Track& track, double hard_detection_share);

/// Returns P_D of a class for a fully visible object. `size_px`: root of its box's area.
double detectionProbability(const ClassPrior& prior, double size_px, const FrameContext& frame);

/// Returns the evidence of one observation about the size at which P_D is halved.
SizeEvidence sizeEvidence(const ClassPrior& prior, double size_px, bool detected,
                          const FrameContext& frame);

/// Returns P_D of a hypothesis. *Other* is detected as far as it resembles a class.
double detectionProbabilityOf(const Hypothesis& hypothesis, const Track& track, double size_px,
                              const FrameContext& frame);
/// Returns the factor on P_D by earlier visits at this viewpoint; 1 for a moving track.
double detectionRateFactor(const Track& track, const FrameContext& frame);

/// Moves detectability towards its stationary value as the view changes.
void predictDetectability(Track& track, const ViewWalk& walk);

/// Updates the causes of misses by an observation. `mean_A`: mean of A over the hypotheses.
void updateDetectability(Track& track, double mean_A, double hard_detection_share);

}  // namespace perdure::semantic_filter
