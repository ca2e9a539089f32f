// What a map's file knows of an object beside its belief: the anchors that it belongs to, what was
// joined with it, and the loops that hold the map together there.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "common/mapping/map_frames.h"
#include "common/mapping/saved_map.h"
#include "common/types/map.h"

namespace perdure::tools {

/// An anchor that an object was seen from.
struct Station {
  mapping::AnchorId anchor = 0;
  WorldId session;
  TimePoint time;      ///< when the body was there
  double way_m = 0.0;  ///< of the session, until there
};

struct Standing {
  mapping::FrameInMap frame;
  double moved_m = 0.0;                    ///< by the graph, from where it is stored in W
  std::optional<Station> newest, earlier;  ///< earlier: on the visit before the newest one
  std::uint32_t recalls = 0, restarts = 0;
  std::vector<ObjectId> absorbed;  ///< ids that were merged into it
  /// That end where it was seen from, the newest first.
  struct Loop {
    mapping::EdgeId id = 0;
    mapping::AnchorId a = 0, b = 0;
    bool by_tracking = false;  ///< by objects seen again under their ids; else by a constellation
    double weight = 0.0;       ///< [0, 1]
  };
  std::vector<Loop> loops;
};

/// `belief` as stored, in its W. Loops are those with an end within 60 m in M of where it was seen
/// from.
Standing standingOf(const ObjectBelief& belief, const WorldId& world, const mapping::SavedMap& map,
                    std::vector<ObjectId> absorbed);

std::string toText(const Standing& standing);
nlohmann::ordered_json toJson(const Standing& standing);

}  // namespace perdure::tools
