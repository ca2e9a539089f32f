// Applies corrections of people to published objects. The filter's own belief never contains them.
#pragma once

#include <map>
#include <vector>

#include "common/types/corrections.h"
#include "common/types/objects.h"

namespace perdure::semantic_filter {

class Corrections {
 public:
  /// Replaces the corrections by those of a `map/near` message.
  void take(const std::vector<Correction>& corrections);
  /// Corrects the objects, which are sorted by id, and copies their own beliefs to `as_estimated`.
  /// Of several tracks that people joined, the one detected last remains.
  void apply(Objects& objects) const;
  /// Gives events the ids of the objects that apply() returned. Leaves out events about tracks that
  /// it left out, and merges of tracks that people joined before.
  void apply(std::vector<Event>& events, const Objects& objects) const;

 private:
  ObjectId objectOf(ObjectId id) const;

  std::map<ObjectId, ObjectId> joined_;  ///< the lowest id of those that people joined
  CorrectionsOf of_;
};

}  // namespace perdure::semantic_filter
