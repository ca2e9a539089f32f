// Answers to queries about the graph: anchors with poses and deviations, and loop closures.
#pragma once

#include <vector>

#include "common/mapping/mapper.h"
#include "common/types/map.h"

namespace perdure::map_store {

/// The largest number of anchors in an answer; eight times as many loop closures.
inline constexpr std::uint32_t kMostAnchors = 4096;

/// Fills anchors, loops, their counts and `truncated`. They belong to the M of `session`; if
/// `session` has no anchor, to the M of the newest session. `withdrawn`: loop closures that were
/// removed from the graph. Those whose id is in use again are left out.
void putGraph(mapping::Mapper& mapper, const std::vector<mapping::LoopWithdrawal>& withdrawn,
              const WorldId& session, const MapQuery& query, MapReply& reply);

}  // namespace perdure::map_store
