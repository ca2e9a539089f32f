// The anchors of an object, the objects merged into it, and the loops near its anchors.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "common/mapping/map_frames.h"
#include "common/mapping/saved_map.h"
#include "common/types/map.h"

namespace perdure::tools {

/// An anchor from which an object was detected.
struct Station {
  mapping::AnchorId anchor = 0;
  WorldId session;
  TimePoint time;      ///< time of the body at the anchor
  double way_m = 0.0;  ///< distance travelled in the session up to the anchor
};

struct Standing {
  mapping::FrameInMap frame;
  double moved_m = 0.0;                    ///< distance between the positions in W and in M
  std::optional<Station> newest, earlier;  ///< anchors of the newest visit and of the one before
  std::uint32_t recalls = 0, restarts = 0;
  std::vector<ObjectId> absorbed;  ///< ids that were merged into it
  /// Loops with an end near its anchors, the newest first.
  struct Loop {
    mapping::EdgeId id = 0;
    mapping::AnchorId a = 0, b = 0;
    bool by_tracking = false;  ///< true: a tie; false: a loop by objects or landmarks
    double weight = 0.0;       ///< range [0, 1]
  };
  std::vector<Loop> loops;
};

/// `belief` and `world` are as stored; `map` is the graph. The loops of the result have an end
/// within 60 m, in M, of one of the object's anchors.
Standing standingOf(const ObjectBelief& belief, const WorldId& world, const mapping::SavedMap& map,
                    std::vector<ObjectId> absorbed);

std::string toText(const Standing& standing);
nlohmann::ordered_json toJson(const Standing& standing);

}  // namespace perdure::tools
