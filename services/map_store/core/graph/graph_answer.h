// Answers queries about the graph with anchors, their poses and standard deviations, and loop
// closures.
#pragma once

#include <vector>

#include "common/mapping/mapper.h"
#include "common/types/map.h"

namespace perdure::map_store {

/// The largest number of anchors in an answer. It has at most eight times as many loop closures.
inline constexpr std::uint32_t kMostAnchors = 4096;

/// Sets anchors, loops, their counts and `truncated` of `reply`. Anchors and loops are those in the
/// M of `session`, or of the newest session if `session` has no anchor. `withdrawn` are loop
/// closures that were removed from the graph; those whose id is in use again are left out.
void putGraph(mapping::Mapper& mapper, const std::vector<mapping::LoopWithdrawal>& withdrawn,
              const WorldId& session, const MapQuery& query, MapReply& reply);

}  // namespace perdure::map_store
