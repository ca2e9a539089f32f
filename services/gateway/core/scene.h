// The objects as foxglove.SceneUpdate: a cuboid, its 2-sigma ellipsoid and its name for each
// confirmed object. Edges are dashed if the object is occluded, and faint if it is out of view.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/types/map.h"
#include "common/types/objects.h"

namespace perdure::gateway {

/// `changes` since the previous update, and the `whole` scene for clients that have not received
/// that update.
struct SceneUpdate {
  std::string changes, whole;
};

class Scene {
 public:
  SceneUpdate update(const Objects& objects);

 private:
  std::optional<WorldId> world_;
  std::map<ObjectId, std::string> shown_;  ///< JSON of the entities shown
};

/// Returns the durable map as foxglove.SceneUpdate in the frame `map`: pale cuboids, dashed if
/// provisional. `objects` are in M; those in `working` are omitted. Each message is complete.
std::string mapScene(const std::vector<MapObject>& objects, const std::set<ObjectId>& working,
                     TimePoint time);

}  // namespace perdure::gateway
