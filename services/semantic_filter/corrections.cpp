#include "services/semantic_filter/corrections.h"

#include <algorithm>
#include <tuple>
#include <utility>

#include "common/base/algorithms/disjoint_sets.h"

namespace perdure::semantic_filter {

ObjectId Corrections::objectOf(ObjectId id) const {
  const auto at = joined_.find(id);
  return at == joined_.end() ? id : at->second;
}

void Corrections::take(const std::vector<Correction>& corrections) {
  DisjointSets<ObjectId> sets;
  for (const Correction& each : corrections) {
    if (each.kind == CorrectionKind::kSame) sets.join(each.object, each.other);
  }
  joined_ = sets.roots();
  of_ = standingByObject(corrections, [this](ObjectId id) { return objectOf(id); });
}

void Corrections::apply(Objects& objects) const {
  objects.as_estimated.clear();
  if (of_.empty()) return;
  for (ObjectBelief& belief : objects.objects) {
    const ObjectId object = objectOf(belief.id), by = objectOf(belief.blocked_by);
    if (!of_.contains(object) && by == belief.blocked_by) continue;
    objects.as_estimated.push_back(belief);
    belief.blocked_by = by;
    const TrackId track = belief.trackId();
    belief.track = track == object ? 0 : track;
    belief.id = object;
    correct(of_, belief);
  }
  std::ranges::sort(objects.objects, [](const ObjectBelief& a, const ObjectBelief& b) {
    return std::tuple(a.id, b.last_seen, a.trackId()) < std::tuple(b.id, a.last_seen, b.trackId());
  });
  const auto rest = std::ranges::unique(objects.objects, {}, &ObjectBelief::id);
  objects.objects.erase(rest.begin(), rest.end());
}

void Corrections::apply(std::vector<Event>& events, const Objects& objects) const {
  const auto isLeftOut = [&](const Event& event) {
    const ObjectId object = objectOf(event.object_id);
    const auto shown = std::ranges::find(objects.objects, object, &ObjectBelief::id);
    if (!joined_.contains(event.object_id) || shown == objects.objects.end()) return false;
    const auto own = std::ranges::find(objects.as_estimated, shown->trackId(),
                                       [](const ObjectBelief& each) { return each.trackId(); });
    return own != objects.as_estimated.end() && own->id != event.object_id;
  };
  std::erase_if(events, isLeftOut);
  for (Event& event : events) {
    event.object_id = objectOf(event.object_id);
    event.other_id = objectOf(event.other_id);
  }
  std::erase_if(events, [](const Event& event) {
    return event.kind == EventKind::kMerged && event.object_id == event.other_id;
  });
}

}  // namespace perdure::semantic_filter
