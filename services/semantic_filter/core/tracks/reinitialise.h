// What exists and has lost its place and shape begins again from a box that is its own, under its
// id.
#pragma once

#include <optional>
#include <vector>

#include "services/semantic_filter/core/tracks/initiation.h"

namespace perdure::semantic_filter {

/// Id, existence and known classes (`pmf`, of before the loss) stay; geometry and motion are those
/// of a birth. False, and the track left as it is, where the box cannot fix one.
bool reinitialise(Track& track, const std::vector<ClassNumber>& pmf, const BoxDetection& detection,
                  const std::optional<RangeHint>& range, const FrameContext& frame);

}  // namespace perdure::semantic_filter
