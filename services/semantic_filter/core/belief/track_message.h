// The published belief of an track, and back.
#pragma once

#include "services/semantic_filter/core/belief/track.h"

namespace perdure::semantic_filter {

/// The published belief: per class its hypotheses as one Gaussian around the heaviest one.
ObjectBelief toBelief(const Track& track, double min_speed);

/// A belief that came back as an track with one hypothesis for each class. `back` is kRestore or
/// kRecall.
Track fromBelief(const ObjectBelief& belief, const Matrix6d& pose_product, ExistenceEvidence back);

}  // namespace perdure::semantic_filter
