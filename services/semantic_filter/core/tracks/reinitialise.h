// Re-initialisation: state and shape of a track again, from a box assigned to it (paper,
// "Initialization", line 284). Derivation: tools/docs/maths/initiation.md.
#pragma once

#include <optional>
#include <vector>

#include "services/semantic_filter/core/tracks/initiation.h"

namespace perdure::semantic_filter {

/// Id, existence and known classes stay; geometry and motion are those of an initiation. `pmf`: of
/// the track before it lost its shape. Returns false, and leaves the track as it is, if the box
/// does not determine a track.
bool reinitialise(Track& track, const ClassNumbers& pmf, const BoxDetection& detection,
                  const std::optional<RangeHint>& range, const FrameContext& frame);

}  // namespace perdure::semantic_filter
