// Derives `object_state` from `objects`: the keyed states to write or to dispose of.
#pragma once

#include <map>
#include <vector>

#include "common/types/objects.h"

namespace perdure::semantic_filter {

class ObjectStates {
 public:
  struct Changes {
    /// new, updated by a frame, or changed in visibility or confirmation
    std::vector<ObjectState> written;
    std::vector<ObjectState> gone;  ///< only the key is valid
  };
  Changes update(const Objects& objects);

 private:
  struct Sent {
    TimePoint as_of;
    Visibility visibility = Visibility::kVisible;
    bool confirmed = false;
  };
  std::map<ObjectId, Sent> sent_;
};

}  // namespace perdure::semantic_filter
