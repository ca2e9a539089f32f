#include "common/mapping/fusion/provenance.h"

#include <algorithm>

namespace perdure::mapping {
namespace {

bool isOne(const Origin& a, const Origin& b) {
  return a.id == b.id && a.first_seen == b.first_seen && a.map.matches(b.map);
}

std::vector<Origin> under(const std::multimap<ObjectId, std::size_t>& index, ObjectId id,
                          const std::vector<Origin>& all) {
  std::vector<Origin> found;
  const auto [begin, end] = index.equal_range(id);
  for (auto at = begin; at != end; ++at) found.push_back(all[at->second]);
  return found;
}

}  // namespace

Provenance::Provenance(const MapContents& map)
    : map_(map), root_(sessionsOf(map.graph).front().identity) {
  for (const Origin& origin : map.origins) add(origin);
}

bool Provenance::isOwn(const Origin& origin) const {
  return origin.id == origin.now && origin.map.matches(root_);
}

Origin Provenance::nameOf(ObjectId id) const {
  for (const Origin& origin : toldOf(id)) {
    if (isOwn(origin)) return origin;
  }
  const ObjectBelief& belief = map_.objects.at(id).belief;
  return {root_, id, id, belief.first_seen, belief.last_seen};
}

std::vector<Origin> Provenance::toldOf(ObjectId id) const { return under(by_now_, id, told_); }

/// A belief newer than all its recorded origins contains observations of this map.
std::vector<Origin> Provenance::of(ObjectId id) const {
  const StoredObject& object = map_.objects.at(id);
  auto all = under(object.ended ? by_now_ : by_survivor_, id, told_);
  TimePoint newest{};
  for (const Origin& origin : all) newest = std::max(newest, origin.last_seen);
  if (!all.empty() && object.belief.last_seen <= newest) return all;
  Origin own = nameOf(id);
  own.last_seen = object.belief.last_seen;
  std::erase_if(all, [&](const Origin& origin) { return isOne(origin, own); });
  all.push_back(own);
  return all;
}

bool Provenance::covers(ObjectId id, const Origin& origin) const {
  const auto all = of(id);
  return std::any_of(all.begin(), all.end(), [&](const Origin& known) {
    return isOne(known, origin) && known.last_seen >= origin.last_seen;
  });
}

Known Provenance::find(const Origin& origin) const {
  const auto [begin, end] = by_id_.equal_range(origin.id);
  for (auto at = begin; at != end; ++at) {
    const Origin& known = told_[at->second];
    if (isOne(known, origin) && map_.objects.contains(known.now)) return {known.now, true};
  }
  const bool here = map_.objects.contains(origin.id) && origin.map.matches(root_);
  if (!here || nameOf(origin.id).first_seen != origin.first_seen) return {};
  return {origin.id, false};
}

void Provenance::add(const Origin& origin) {
  const auto [begin, end] = by_now_.equal_range(origin.now);
  for (auto at = begin; at != end; ++at) {
    Origin& known = told_[at->second];
    if (!isOne(known, origin)) continue;
    known.last_seen = std::max(known.last_seen, origin.last_seen);
    return;
  }
  by_id_.emplace(origin.id, told_.size());
  by_now_.emplace(origin.now, told_.size());
  by_survivor_.emplace(survivorOf(map_, origin.now), told_.size());
  told_.push_back(origin);
}

void Provenance::tell(ObjectId id) {
  for (Origin origin : of(id)) {
    if (!isOwn(origin) || origin.now != id) continue;
    add(origin);
  }
}

}  // namespace perdure::mapping
