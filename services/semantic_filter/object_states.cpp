#include "services/semantic_filter/object_states.h"

#include <set>

namespace perdure::semantic_filter {

ObjectStates::Changes ObjectStates::update(const Objects& objects) {
  Changes changes;
  std::set<ObjectId> present;
  for (const auto& o : objects.objects) {
    present.insert(o.id);
    const auto [it, fresh] = sent_.try_emplace(o.id);
    Sent& sent = it->second;
    if (!fresh && sent.as_of == o.as_of && sent.visibility == o.visibility &&
        sent.confirmed == o.confirmed) {
      continue;
    }
    sent = {o.as_of, o.visibility, o.confirmed};
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
