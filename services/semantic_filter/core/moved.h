// One thing that was moved, or drove off, while nobody could follow it: it is missing where it
// stood, and a newcomer of its class is near by (DESIGN 5, item 11).
#pragma once

#include <vector>

#include "services/semantic_filter/core/merge.h"

namespace perdure::semantic_filter {

/// Gives the newcomer the id and the past of what is missing; its own id is absorbed. Newcomers are
/// confirmed and were first seen when the other was seen no more. One that moves must have been
/// where the other stood when that was last seen; one that stands is of a class that is carried,
/// near by, at a place that was looked at before, and empty. Each is taken with the nearest that
/// would have it, too.
std::vector<MergeRecord> reuniteMoved(std::vector<Object>& objects, const ClassPriors& priors);

}  // namespace perdure::semantic_filter
