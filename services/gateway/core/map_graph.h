// Graph of the map for display: anchors and loops in M, as answered by map_store.
#pragma once

#include <cstdint>
#include <string>

#include "common/types/map.h"

namespace perdure::gateway {

/// Largest number of anchors requested, nearest to the body first.
inline constexpr std::uint32_t kMostOfGraph = 2000;

/// Decides when map_store is queried: at once for a new client, then after changes, at a low rate.
/// A large graph is queried less often, so that the bytes per second are about constant.
class GraphPace {
 public:
  /// The graph may differ from the last answer.
  void changed() { stale_ = true; }
  bool due(std::int64_t now_ns);
  void answered(const MapReply& reply, std::int64_t now_ns);
  /// Repeats the query later, if clients still need it.
  void refused(std::int64_t now_ns);
  void begin() { stale_ = true, waits_ = false, next_ns_ = 0; }

 private:
  bool stale_ = false, waits_ = false;
  std::int64_t next_ns_ = 0;
};

/// The part of a reply that lies on the displayed map.
MapReply graphOn(const WorldId& map, MapReply reply);

/// "perdure.MapGraph", in M. `why_none`: a sentence if there is no graph.
std::string mapGraphJson(const MapReply& graph, const std::string& why_none, TimePoint time);

/// The graph as foxglove.SceneUpdate in the frame `map`. Anchors are spheres, the trajectory is a
/// line, and loops are arches in the colour of their state. Metadata describe each entity. Each
/// message is complete and replaces the previous one.
std::string mapGraphScene(const MapReply& graph, TimePoint time);

}  // namespace perdure::gateway
