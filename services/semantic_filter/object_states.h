// `object_state` from `objects`: which keyed states to write and which to dispose of.
#pragma once

#include <map>
#include <vector>

#include "common/types/objects.h"

namespace perdure::semantic_filter {

class ObjectStates {
 public:
  struct Changes {
    std::vector<ObjectState> written;  ///< new ones, those a frame updated, changed visibility
    std::vector<ObjectState> gone;     ///< only their key means anything
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
