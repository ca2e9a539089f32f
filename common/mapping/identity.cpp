#include "common/mapping/identity.h"

#include <algorithm>
#include <functional>
#include <limits>
#include <utility>

#include "common/base/algorithms/disjoint_sets.h"

namespace perdure::mapping {
namespace {

struct Link {
  double nats = 0.0;
  TrackId a = 0, b = 0;
};

}  // namespace

Identity::Identity(std::set<SameObject> facts, std::vector<Correction> corrections)
    : facts_(std::move(facts)) {
  setCorrections(std::move(corrections));
}

void Identity::setCorrections(std::vector<Correction> corrections) {
  corrections_ = std::move(corrections);
  stated_.clear();
  for (const Correction& each : corrections_) {
    if (!each.aboutTwo() || each.withdrawn || each.object == each.other) continue;
    const bool same = each.kind == CorrectionKind::kSame;
    stated_[std::minmax(each.object, each.other)] += same ? each.nats : -each.nats;
  }
  connect();
}

bool Identity::areSeparated(TrackId a, TrackId b) const {
  const auto ends = std::minmax({objectOf(a), objectOf(b)});
  return std::ranges::any_of(stated_, [&](const auto& each) {
    const auto& [one, other] = each.first;
    return each.second < 0.0 && std::minmax({objectOf(one), objectOf(other)}) == ends;
  });
}

std::set<TrackId> Identity::reachOf(TrackId a, TrackId b) const {
  std::set<TrackId> reach{a, b};
  if (stated_.empty()) {
    for (const TrackId track : {a, b}) {
      const auto& tracks = tracksOf(objectOf(track));
      reach.insert(tracks.begin(), tracks.end());
    }
    return reach;
  }
  DisjointSets<TrackId> sets;
  for (const SameObject& fact : facts_) sets.join(fact.a, fact.b);
  for (const auto& [pair, nats] : stated_) sets.join(pair.first, pair.second);
  for (const auto& [track, root] : sets.roots()) {
    if (root == sets.rootOf(a) || root == sets.rootOf(b)) reach.insert(track);
  }
  return reach;
}

ObjectId Identity::observedObjectOf(TrackId track) const {
  if (stated_.empty()) return objectOf(track);
  const auto at = observed_object_of_.find(track);
  return at == observed_object_of_.end() ? track : at->second;
}

void Identity::add(const SameObject& fact) {
  if (fact.a != fact.b && facts_.insert(fact).second) connect();
}

void Identity::endLoop(EdgeId loop) {
  if (std::erase_if(facts_, [loop](const SameObject& fact) { return fact.loop == loop; }) > 0) {
    connect();
  }
}

std::set<SameObject> Identity::mergesByFilter() const {
  const auto merges = factsOf(0);
  return {merges.begin(), merges.end()};
}

void Identity::replaceLoop(EdgeId loop, EdgeId by) {
  for (const SameObject& fact : factsOf(loop)) {
    facts_.erase(fact);
    facts_.insert({by, fact.a, fact.b});
  }
}

ObjectId Identity::objectOf(TrackId track) const {
  const auto at = object_of_.find(track);
  return at == object_of_.end() ? track : at->second;
}

const std::vector<TrackId>& Identity::tracksOf(ObjectId object) const {
  static const std::vector<TrackId> kNone;
  const auto at = tracks_of_.find(object);
  return at == tracks_of_.end() ? kNone : at->second;
}

std::vector<SameObject> Identity::factsOf(EdgeId loop) const {
  std::vector<SameObject> result;
  for (auto at = facts_.lower_bound({loop, 0, 0}); at != facts_.end() && at->loop == loop; ++at) {
    result.push_back(*at);
  }
  return result;
}

/// Joins the pairs of facts, and of corrections if `by_people`, the strongest evidence first.
/// Merges by the filter are final. Returns the objects with several tracks.
Identity::Objects Identity::joined(bool by_people) const {
  constexpr double kFinal = std::numeric_limits<double>::infinity();
  std::vector<Link> links;
  for (const SameObject& fact : facts_) {
    links.push_back({fact.loop == 0 ? kFinal : kLoopFactNats, fact.a, fact.b});
  }
  for (const auto& [pair, nats] : stated_) {
    if (by_people && nats > 0.0) links.push_back({nats, pair.first, pair.second});
  }
  std::ranges::stable_sort(links, std::greater(), &Link::nats);
  DisjointSets<TrackId> sets;
  for (const Link& link : links) {
    const auto ends = std::minmax({sets.rootOf(link.a), sets.rootOf(link.b)});
    const bool denied = std::ranges::any_of(stated_, [&](const auto& each) {
      return -each.second > link.nats &&
             std::minmax({sets.rootOf(each.first.first), sets.rootOf(each.first.second)}) == ends;
    });
    if (!denied) sets.join(link.a, link.b);
  }
  Objects objects = sets.roots();
  std::map<ObjectId, int> sizes;
  for (const auto& [track, object] : objects) ++sizes[object];
  std::erase_if(objects, [&](const auto& each) { return sizes.at(each.second) == 1; });
  return objects;
}

void Identity::connect() {
  object_of_ = joined(true);
  observed_object_of_ = stated_.empty() ? Objects() : joined(false);
  tracks_of_.clear();
  for (const auto& [track, object] : object_of_) tracks_of_[object].push_back(track);
}

}  // namespace perdure::mapping
