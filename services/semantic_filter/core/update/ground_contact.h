// What stands on the ground: a consider update of its underside.
#pragma once

#include "services/semantic_filter/core/belief/state.h"
#include "services/semantic_filter/core/measurement/frame.h"

namespace perdure::semantic_filter {

/// Keeps what the hypothesis, as the looks alone have it, says of the ground (GroundContact), and
/// then makes it stand there as far as its class does: a consider update. Returns log p(underside |
/// the ground) against undersides anywhere within ground.span_m: 0 where nothing is known.
double updateWithGround(Hypothesis& h, ObjectId id, const FrameContext& frame);

}  // namespace perdure::semantic_filter
