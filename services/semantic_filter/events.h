// Derives events from the differences between two published frames.
#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "common/types/objects.h"
#include "services/semantic_filter/core/tracks/merge.h"

namespace perdure::semantic_filter {

class EventTracker {
 public:
  struct Changes {
    std::vector<Event> events;      ///< ordered by track
    std::vector<EndedTrack> ended;  ///< merged, or confirmed and gone
  };
  /// Returns the changes since the last call. `merges`: those since the last call. `blank`: an
  /// event with stamp and writer.
  Changes update(const Objects& objects, const std::vector<MergeRecord>& merges,
                 const Event& blank);
  /// Notes that the track comes from the map. The next update that has the track creates the event.
  void recalled(TrackId id, bool restored) { recalled_[id] = restored; }
  /// Notes that the track is archived. The next update creates its event.
  void archived(TrackId id) { archived_.insert(id); }
  void clear() { *this = {}; }
  bool wasConfirmed(TrackId id) const;

 private:
  struct Known {
    bool confirmed = false, resolved = false, missing = false, moving = false;
    bool hidden = false;  ///< not visible, and not detected since
    std::uint32_t hits = 0;
    ObjectId id = 0;  ///< as published
    bool static_once = false, ever_confirmed = false;
    std::string class_name;
  };

  static Known comeBack(const ObjectBelief& object);
  void merge(const MergeRecord& merge, const Objects& objects, const Event& blank,
             Changes& changes);
  void compare(const ObjectBelief& object, Known& known, std::vector<Event>& events,
               const Event& blank);

  std::map<TrackId, Known> known_;
  std::map<TrackId, bool> recalled_;  ///< whether it was restored
  std::set<TrackId> archived_;
};

/// Derives `object_state` from `objects`: the keyed states to write or to dispose of.
class ObjectStates {
 public:
  struct Changes {
    /// new, updated by a frame, corrected by people, or changed in visibility or confirmation
    std::vector<ObjectState> written;
    std::vector<ObjectState> gone;  ///< only the key is valid
  };
  Changes update(const Objects& objects);

 private:
  struct Sent {
    TimePoint as_of;
    Visibility visibility = Visibility::kVisible;
    bool confirmed = false;
    std::string class_name;  ///< of objects that people corrected
    double existence = 0.0;  ///< of objects that people corrected
    bool operator==(const Sent&) const = default;
  };
  std::map<ObjectId, Sent> sent_;
};

}  // namespace perdure::semantic_filter
