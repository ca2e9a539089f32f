// Ground contact: a consider update of a hypothesis by the height of the ground below it (Schmidt
// 1966; the paper has none). Derivation: tools/docs/maths/ground_contact.md.
#pragma once

#include "services/semantic_filter/core/belief/state.h"
#include "services/semantic_filter/core/measurement/frame.h"

namespace perdure::semantic_filter {

/// Stores what the boxes alone say of the ground (GroundContact), and updates the hypothesis by the
/// ground, without what track `id` says of it. Returns log p(underside | ground) against a uniform
/// one, nats; 0 for unknown ground.
double updateWithGround(Hypothesis& h, ObjectId id, const FrameContext& frame);

}  // namespace perdure::semantic_filter
