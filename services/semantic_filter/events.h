// Makes events from the differences between two published frames.
#pragma once

#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "common/types/objects.h"
#include "services/semantic_filter/core/tracks/merge.h"

namespace perdure::semantic_filter {

class EventTracker {
 public:
  /// An object goes on under another id.
  void renamed(ObjectId from, ObjectId to);
  /// Returns the events since the last call, ordered by object id. `merges`: those since then.
  std::vector<Event> update(const Objects& objects, const std::vector<MergeRecord>& merges);
  /// An object was recalled with this id. The next update makes its event.
  void recalled(ObjectId id, bool restored) { recalled_[id] = restored; }
  /// An object is archived from now on. The next update makes its event.
  void archived(ObjectId id) { archived_.insert(id); }
  void clear();

 private:
  struct Known {
    bool confirmed = false, resolved = false, missing = false, moving = false;
    bool hidden = false;  ///< not visible, and not detected since
    std::uint32_t hits = 0;
    bool static_once = false, ever_confirmed = false;
    std::string class_name;
  };

  static Known comeBack(const ObjectBelief& object);
  void compare(const ObjectBelief& object, Known& known, std::vector<Event>& events,
               const Event& blank);

  std::map<ObjectId, Known> known_;
  std::map<ObjectId, bool> recalled_;  ///< whether it was restored
  std::set<ObjectId> archived_;
};

}  // namespace perdure::semantic_filter
