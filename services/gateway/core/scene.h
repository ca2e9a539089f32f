// The objects as foxglove.SceneUpdate: a cuboid, its 2-sigma ellipsoid and its name for each
// confirmed object. Edges are dashed if the object is occluded, and faint if it is out of view.
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
  /// The whole scene in one message, so that a client may lose messages. Deletions are repeated in
  /// the next hundred messages.
  std::string update(const Objects& objects);

 private:
  struct Gone {
    ObjectId id = 0;
    int told = 0;
  };
  std::optional<WorldId> world_;
  std::set<ObjectId> shown_;
  std::deque<Gone> gone_;
  int clear_ = 0;  ///< remaining messages that delete the whole previous scene
};

/// The durable map as foxglove.SceneUpdate in the frame `map`: pale cuboids with their names,
/// dashed if provisional. Each message is complete and replaces the previous one. `objects` are in
/// M. Those in `working` are left out, because `Scene` shows them.
std::string mapScene(const std::vector<MapObject>& objects, const std::set<ObjectId>& working,
                     TimePoint time);

}  // namespace perdure::gateway
