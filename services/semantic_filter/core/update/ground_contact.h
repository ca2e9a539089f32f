// Ground contact: a consider update of a hypothesis by the height of the ground below it (Schmidt
// 1966; not in the paper). Derivation: tools/docs/maths/ground_contact.md.
#pragma once

#include "services/semantic_filter/core/belief/state.h"
#include "services/semantic_filter/core/measurement/frame.h"

namespace perdure::semantic_filter {

/// Stores the evidence of the boxes alone about the ground (GroundContact). Then updates the
/// hypothesis by the ground below it, if objects of its class stand on the ground. The ground is
/// computed without track `id`. Returns log p(underside | ground) against an underside that is
/// uniform within ground.span_m, nats; 0 if the ground is unknown.
double updateWithGround(Hypothesis& h, ObjectId id, const FrameContext& frame);

}  // namespace perdure::semantic_filter
