// Whether the stamps of two cameras are of one clock: both turn at the same time, and what their
// own way adds to the turning of their images is nearly the same in both.
#pragma once

#include <optional>

#include "common/replay/dataset.h"

namespace perdure::tools {

/// How much later than its stamp says cam1 saw what cam0 saw, s (negative: sooner), where its
/// images turn as those of cam0 at that time and clearly not at their own. Looks 2.5 s to both
/// sides.
std::optional<double> lateStampsOfSecond(const replay::Recording& recording);

}  // namespace perdure::tools
