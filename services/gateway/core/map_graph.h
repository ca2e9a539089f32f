// The graph of the map for display: anchors and loops in M, from replies of map_store.
#pragma once

#include <cstdint>
#include <string>

#include "common/types/map.h"

namespace perdure::gateway {

/// The largest number of anchors in a reply; those nearest to the body are requested.
inline constexpr std::uint32_t kMostOfGraph = 2000;

/// Decides when map_store is queried for the graph: at once for a new client, later after changes,
/// at a low rate. A large graph is queried less often, so that the bytes per second are about
/// constant.
class GraphPace {
 public:
  /// Reports that the graph may differ from the last answer.
  void changed() { stale_ = true; }
  bool due(std::int64_t now_ns);
  void answered(const MapReply& reply, std::int64_t now_ns);
  /// Reports that a query was refused. due() becomes true again later.
  void refused(std::int64_t now_ns);
  void begin() { stale_ = true, waits_ = false, next_ns_ = 0; }

 private:
  bool stale_ = false, waits_ = false;
  std::int64_t next_ns_ = 0;
};

/// Returns the part of a reply that belongs to the displayed map.
MapReply graphOn(const WorldId& map, MapReply reply);

/// Returns "perdure.MapGraph", in M. `why_none`: why there is no graph, as a sentence; otherwise
/// empty.
std::string mapGraphJson(const MapReply& graph, const std::string& why_none, TimePoint time);

/// Returns the graph as foxglove.SceneUpdate in the frame `map`. Anchors are spheres, the
/// trajectory is a line, and loops are arches in the colour of their state. Metadata describe each
/// entity. Each message is complete and replaces the previous one.
std::string mapGraphScene(const MapReply& graph, TimePoint time);

}  // namespace perdure::gateway
