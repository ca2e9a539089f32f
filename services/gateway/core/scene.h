// The objects as foxglove.SceneUpdate: a cuboid, its 2-sigma ellipsoid and its name for each
// confirmed object; edges are dashed where something hides it, faint where it is out of view.
#pragma once

#include <deque>
#include <optional>
#include <set>
#include <string>

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

}  // namespace perdure::gateway
