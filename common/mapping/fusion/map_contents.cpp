#include "common/mapping/fusion/map_contents.h"

#include <algorithm>
#include <string>
#include <tuple>

namespace perdure::mapping {
namespace {

/// Digest of the contents that can differ between copies of one map.
std::uint64_t digestOf(const MapContents& map) {
  std::string text;
  const auto add = [&](auto value) {
    text.append(reinterpret_cast<const char*>(&value), sizeof value);
  };
  for (const auto& [id, object] : map.objects) {
    add(id);
    add(object.world.world);
    add(toNanoseconds(object.belief.last_seen));
    add(object.belief.existence);
    for (const double each : object.belief.best().mean) add(each);
  }
  for (const auto& [id, edge] : map.graph.edges) add(edge.weight);
  return digest(text);
}

}  // namespace

std::size_t MapContents::present() const {
  return static_cast<std::size_t>(std::count_if(
      objects.begin(), objects.end(), [](const auto& each) { return !each.second.ended; }));
}

ObjectId MapContents::largestId() const { return objects.empty() ? 0 : objects.rbegin()->first; }

ObjectId survivorOf(const MapContents& map, ObjectId id) {
  for (std::size_t step = 0; step < map.objects.size(); ++step) {
    const auto at = map.objects.find(id);
    if (at == map.objects.end() || !at->second.ended) break;
    const Ending& ended = *at->second.ended;
    if (ended.kind != EventKind::kMerged || !map.objects.contains(ended.merged_into)) break;
    id = ended.merged_into;
  }
  return id;
}

bool comesFirst(const MapContents& a, const MapContents& b) {
  const auto of_a = sessionsOf(a.graph), of_b = sessionsOf(b.graph);
  if (of_a.empty() || of_b.empty()) return of_a.size() > of_b.size();
  if (!of_a.front().identity.matches(of_b.front().identity)) {
    const auto key = [](const MapContents& map, const std::vector<Session>& sessions) {
      const Anchor& first = map.graph.anchors.at(sessions.front().anchors.front()).anchor;
      return std::tuple(first.stamp.time, sessions.front().identity);
    };
    return key(a, of_a) < key(b, of_b);
  }
  const auto known = [](const MapContents& map, const std::vector<Session>& sessions) {
    return std::tuple(sessions.size(), map.graph.anchors.size(), map.objects.size(), digestOf(map));
  };
  return known(a, of_a) > known(b, of_b);
}

}  // namespace perdure::mapping
