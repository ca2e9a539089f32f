// What is said of the graph to who asks for it: anchors where they lie in M with how well that is
// known, and the loops between them.
#pragma once

#include <vector>

#include "common/mapping/mapper.h"
#include "common/types/map.h"

namespace perdure::map_store {

/// So many anchors are told at most, whatever `limit` is; of loops eight times as many, the newest.
inline constexpr std::uint32_t kMostAnchors = 4096;

/// Fills anchors, loops, their counts and `truncated`. They are those of the M that `session` lies
/// in; where that has no anchor, of the M of the newest one. `withdrawn`: loops that are no part of
/// the graph any more; those whose id is told again are left out.
void putGraph(mapping::Mapper& mapper, const std::vector<mapping::LoopWithdrawal>& withdrawn,
              const WorldId& session, const MapQuery& query, MapReply& reply);

}  // namespace perdure::map_store
