// The objects as foxglove.SceneUpdate: a cuboid, its 2-sigma ellipsoid and its name for each
// confirmed object; edges are dashed where something hides it, faint where it is out of view.
#pragma once

#include <deque>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/types/map.h"
#include "common/types/objects.h"

namespace perdure::gateway {

class Scene {
 public:
  /// The whole scene in one message, so that a client may lose any of them; what has gone is told
  /// again in the next hundred.
  std::string update(const Objects& objects);

 private:
  struct Gone {
    ObjectId id = 0;
    int told = 0;
  };
  std::optional<WorldId> world_;
  std::set<ObjectId> shown_;
  std::deque<Gone> gone_;
  int clear_ = 0;  ///< messages that still say that all before is to be deleted
};

/// The durable map as foxglove.SceneUpdate in the frame `map`: pale cuboids with their names,
/// dashed where provisional. Each message is the whole of it and clears what was before. `objects`
/// are in M; those in `working`, which `Scene` shows, are left out.
std::string mapScene(const std::vector<MapObject>& objects, const std::set<ObjectId>& working,
                     TimePoint time);

}  // namespace perdure::gateway
