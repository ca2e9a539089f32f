// The graph of the map, for who looks at it: its anchors and loops in M, as map_store answered.
#pragma once

#include <cstdint>
#include <string>

#include "common/types/map.h"

namespace perdure::gateway {

/// So many anchors are asked for, nearest to the body first.
inline constexpr std::uint32_t kMostOfGraph = 2000;

/// When map_store is asked: where somebody looks, at once and then where the graph has changed, but
/// seldom. A large graph more seldom: about as many bytes a second whatever it holds.
class GraphPace {
 public:
  /// It may be another one than was told last.
  void changed() { stale_ = true; }
  /// Whether to ask now. `now_ns`: a monotonic time.
  bool due(std::int64_t now_ns);
  void answered(const MapReply& reply, std::int64_t now_ns);
  /// It is asked again, where somebody looks still.
  void refused(std::int64_t now_ns);
  void begin() { stale_ = true, waits_ = false, next_ns_ = 0; }

 private:
  bool stale_ = false, waits_ = false;
  std::int64_t next_ns_ = 0;
};

/// What of a reply lies on the map that is looked at.
MapReply graphOn(const WorldId& map, MapReply reply);

/// "perdure.MapGraph", in M. `why_none`: a sentence where there is none.
std::string mapGraphJson(const MapReply& graph, const std::string& why_none, TimePoint time);

/// The same as foxglove.SceneUpdate in the frame `map`: anchors as spheres, the way between them as
/// a line, loops as raised lines in the colour of their state. Metadata say what each is. Each
/// message is the whole of it and clears what was before.
std::string mapGraphScene(const MapReply& graph, TimePoint time);

}  // namespace perdure::gateway
