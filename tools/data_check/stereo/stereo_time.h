// Checks whether the stamps of two cameras have the same clock. Both cameras rotate at the same
// time, and translation affects both image rotations nearly equally.
#pragma once

#include <optional>

#include "common/replay/dataset.h"

namespace perdure::tools {

/// Delay in s of cam1's exposure after its stamp, by the clock of cam0 (negative: earlier).
/// Returned only if the rotations agree at that delay and clearly not at 0. Searches ±2.5 s.
std::optional<double> lateStampsOfSecond(const replay::Recording& recording);

}  // namespace perdure::tools
