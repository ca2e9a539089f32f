#include "services/semantic_filter/events.h"

#include <algorithm>
#include <set>

#include "common/base/scratch.h"

namespace perdure::semantic_filter {
namespace {

constexpr double kResolved = 0.9;      // probability of a class
constexpr double kMissingBelow = 0.5;  // existence of a confirmed object

bool isHidden(Visibility v) { return v != Visibility::kVisible && v != Visibility::kPartial; }

Event make(const Event& blank, EventKind kind, const ObjectBelief& object, double probability) {
  Event e = blank;
  e.kind = kind;
  e.object_id = object.id;
  e.class_name = object.best().name;
  e.probability = probability;
  return e;
}

}  // namespace

/// Returns the state of an object that returns from the map, so that its events are not repeated.
EventTracker::Known EventTracker::comeBack(const ObjectBelief& o) {
  Known known;
  known.confirmed = known.ever_confirmed = o.confirmed;
  known.resolved = o.confirmed && o.best().probability >= kResolved;
  known.hidden = isHidden(o.visibility);
  known.hits = o.hits;
  known.moving = o.moving > 0.5;
  known.class_name = o.best().name;
  return known;
}

void EventTracker::compare(const ObjectBelief& o, Known& known, std::vector<Event>& events,
                           const Event& blank) {
  const auto add = [&](EventKind kind, double p) { events.push_back(make(blank, kind, o, p)); };
  if (o.confirmed && !known.ever_confirmed) add(EventKind::kConfirmed, o.existence);
  const double pi = o.best().probability;
  if (o.confirmed && pi >= kResolved && (!known.resolved || known.class_name != o.best().name)) {
    add(EventKind::kClassResolved, pi);
    known.resolved = true;
  }
  const bool hidden = isHidden(o.visibility), detected = o.hits > known.hits;
  if (o.confirmed && hidden && !known.hidden) {
    add(o.visibility == Visibility::kOccluded ? EventKind::kOccluded : EventKind::kLeftView,
        o.existence);
    events.back().other_id = o.blocked_by;
  }
  if (o.confirmed && !hidden && known.hidden && known.confirmed && detected) {
    add(EventKind::kReappeared, o.existence);
  }
  known.ever_confirmed = known.ever_confirmed || o.confirmed;
  const bool missing = known.ever_confirmed && o.existence < kMissingBelow;
  if (missing && !known.missing) add(EventKind::kMissing, o.existence);
  const bool moving = o.moving > 0.5;
  if (o.confirmed && moving && !known.moving && known.static_once) add(EventKind::kMoved, o.moving);
  known.static_once = known.static_once || (o.confirmed && !moving);
  known.confirmed = o.confirmed;
  known.hidden = hidden || (known.hidden && !detected);
  known.hits = o.hits;
  known.missing = missing;
  known.moving = moving;
  known.class_name = o.best().name;
}

bool EventTracker::wasConfirmed(TrackId id) const {
  const auto at = known_.find(id);
  return at != known_.end() && at->second.ever_confirmed;
}

void EventTracker::merge(const MergeRecord& m, const Objects& objects, const Event& blank,
                         Changes& changes) {
  const auto it = known_.find(m.absorbed);
  if (it == known_.end()) return;  // initiated and merged within one frame: never published
  const auto survivor =
      std::find_if(objects.objects.begin(), objects.objects.end(),
                   [&](const ObjectBelief& o) { return o.trackId() == m.survivor; });
  Event e = blank;
  e.kind = EventKind::kMerged;
  e.object_id = survivor == objects.objects.end() ? m.survivor : survivor->id;
  e.other_id = it->second.id;
  e.class_name = it->second.class_name;
  e.probability = 1.0;
  // If the survivor has the older id of the absorbed one, its change of id causes the event.
  if (e.object_id != e.other_id) changes.events.push_back(e);
  if (m.by_map) {
    known_.erase(it);
    return;
  }
  changes.ended.push_back({m.absorbed, m.survivor, objects.stamp.time});
  e.other_id = 0;
  if (m.moved) {
    e.kind = EventKind::kMoved;
    changes.events.push_back(e);
    known_[m.survivor].moving = true;  // a moving object causes no second event
  }
  if (m.returned) {
    e.kind = EventKind::kReappeared;
    changes.events.push_back(e);
    known_[m.survivor] = it->second;
    known_[m.survivor].id = e.object_id;
  }
  known_.erase(it);
}

EventTracker::Changes EventTracker::update(const Objects& objects,
                                           const std::vector<MergeRecord>& merges,
                                           const Event& blank) {
  Changes changes;
  std::vector<Event>& events = changes.events;
  for (const auto& m : merges) merge(m, objects, blank, changes);
  ScratchVector<TrackId> present;
  for (const auto& o : objects.objects) {
    present.push_back(o.trackId());
    const auto [it, fresh] = known_.try_emplace(o.trackId());
    Known& known = it->second;
    if (fresh) {
      const auto back = recalled_.find(o.trackId());
      const EventKind kind = back == recalled_.end() ? EventKind::kBorn
                             : back->second          ? EventKind::kRestored
                                                     : EventKind::kRecalled;
      events.push_back(make(blank, kind, o, o.existence));
      if (back != recalled_.end()) {
        known = comeBack(o);
        recalled_.erase(back);
      }
    } else if (o.id < known.id) {  // the map reports it as an older object
      events.push_back(make(blank, EventKind::kMerged, o, 1.0));
      events.back().other_id = known.id;
    }
    known.id = o.id;
    compare(o, known, events, blank);
  }
  std::sort(present.begin(), present.end());
  std::erase_if(known_, [&](const auto& entry) {
    const auto& [track, known] = entry;
    if (std::binary_search(present.begin(), present.end(), track)) return false;
    if (const bool kept = archived_.contains(track); kept || known.ever_confirmed) {
      Event e = blank;
      e.kind = kept ? EventKind::kArchived : EventKind::kGone;
      e.object_id = known.id;
      e.class_name = known.class_name;
      events.push_back(e);
      if (!kept) changes.ended.push_back({track, 0, objects.stamp.time});
    }
    return true;
  });
  archived_.clear();
  return changes;
}

ObjectStates::Changes ObjectStates::update(const Objects& objects) {
  Changes changes;
  std::set<ObjectId> present, corrected;
  for (const auto& o : objects.as_estimated) corrected.insert(o.id);
  for (const auto& o : objects.objects) {
    present.insert(o.id);
    const auto [it, fresh] = sent_.try_emplace(o.id);
    Sent& sent = it->second;
    Sent now{o.as_of, o.visibility, o.confirmed, {}, 0.0};
    if (corrected.contains(o.id)) now.class_name = o.best().name, now.existence = o.existence;
    if (!fresh && sent == now) continue;
    sent = std::move(now);
    changes.written.push_back({objects.stamp, objects.instance, objects.world, o});
  }
  std::erase_if(sent_, [&](const auto& entry) {
    if (present.contains(entry.first)) return false;
    changes.gone.push_back({objects.stamp, objects.instance, objects.world, {}});
    changes.gone.back().object.id = entry.first;
    return true;
  });
  return changes;
}

}  // namespace perdure::semantic_filter
