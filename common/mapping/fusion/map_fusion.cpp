#include "common/mapping/fusion/map_fusion.h"

#include <algorithm>
#include <set>
#include <utility>

#include "common/mapping/fusion/object_fusion.h"
#include "common/mapping/fusion/overlaps.h"
#include "common/mapping/fusion/sightings.h"
#include "common/mapping/fusion/united_map.h"
#include "common/mapping/graph/components.h"
#include "common/mapping/mapper.h"

namespace perdure::mapping {
namespace {

void apply(SavedMap& map, Unsaved&& unsaved) {
  map.classes = std::move(unsaved.changed.classes);
  for (auto& [id, saved] : unsaved.changed.anchors) map.anchors[id] = std::move(saved);
  for (auto& [id, saved] : unsaved.changed.edges) map.edges[id] = saved;
  for (auto& [id, record] : unsaved.changed.records) {
    // Merges are final: each fused object continues as one track.
    record.sighting.in_anchor.id = id;
    if (record.earlier) record.earlier->in_anchor.id = id;
    map.records[id] = std::move(record);
  }
  for (const EdgeId id : unsaved.edges_gone) map.edges.erase(id);
  for (const ObjectId id : unsaved.records_gone) map.records.erase(id);
}

/// Replays sessions until they yield no more loops.
class Replays {
 public:
  Replays(const SavedMap& map, const Parameters& parameters) : mapper_(parameters, map) {}

  void run(const std::vector<WorldId>& sessions) {
    // A session joined in one pass may yield loops before the place of joining in the next pass.
    constexpr int kMostPasses = 3;
    for (int pass = 0; pass < kMostPasses; ++pass) {
      const std::size_t before = loops_;
      for (const WorldId& session : sessions) replay(session);
      if (loops_ == before) return;
    }
  }

  /// Merges objects that overlap.
  void settle(const MapContents& map) {
    SavedMap aligned = map.graph;
    apply(aligned, mapper_.unsaved());
    for (const MergeOrder& order : overlapping(map, aligned, mapper_.graph())) {
      if (mapper_.identity().areSeparated(order.survivor, order.absorbed)) continue;
      mapper_.onMerged(order.survivor, order.absorbed);
    }
  }

  Mapper& mapper() { return mapper_; }
  std::size_t loops() const { return loops_; }

 private:
  void replay(const WorldId& session) {
    mapper_.replay(session);
    loops_ += mapper_.takeChange().loops.size();
  }

  Mapper mapper_;
  std::size_t loops_ = 0;
};

/// Returns new and continued sessions, followed by those that are not in the largest component.
/// Returns nothing if there are no new or continued sessions.
std::vector<WorldId> toBeReplayed(const MapContents& map, const Addition& addition) {
  std::vector<WorldId> sessions = addition.sessions;
  sessions.insert(sessions.end(), addition.grown.begin(), addition.grown.end());
  if (sessions.empty()) return sessions;
  const auto parts = partsOf(map);
  for (std::size_t k = 1; k < parts.size(); ++k) {
    for (const WorldId& session : parts[k]) {
      const bool there = std::find(sessions.begin(), sessions.end(), session) != sessions.end();
      if (!there) sessions.push_back(session);
    }
  }
  return sessions;
}

std::size_t loopsOf(const SavedMap& map) {
  return static_cast<std::size_t>(
      std::count_if(map.edges.begin(), map.edges.end(), [](const auto& each) {
        return each.second.edge.kind == EdgeKind::kLoop && each.second.weight >= kBelieved;
      }));
}

void align(MapContents& map, const std::vector<WorldId>& sessions, const Parameters& parameters,
           FusionReport& report) {
  const std::size_t before = loopsOf(map.graph);
  Replays replays(map.graph, parameters);
  replays.run(sessions);
  replays.settle(map);
  const std::map<ObjectId, ObjectRecord> records = map.graph.records;
  apply(map.graph, replays.mapper().unsaved());
  report.merges = mergeObjects(map, records, replays.mapper().identity(), replays.mapper().graph());
  const std::size_t after = loopsOf(map.graph);
  report.loops = after > before ? after - before : 0;
}

}  // namespace

FusionReport fuseInto(MapContents& map, const MapContents& other, const Parameters& parameters) {
  const Addition addition = unite(map, other);
  FusionReport report;
  report.added = addition.sessions;
  report.grown = addition.grown;
  report.parted = addition.parted;
  report.known = addition.known;
  report.renewed = addition.renewed.size();
  report.corrections_left_out = addition.corrections_left_out;
  for (const ObjectId id : addition.objects) report.objects += map.objects.at(id).ended ? 0 : 1;
  report.changes = renew(map, addition);
  const auto sessions = toBeReplayed(map, addition);
  if (!sessions.empty()) align(map, sessions, parameters, report);
  const auto gone = endWhatIsGone(map);
  report.changes.insert(report.changes.end(), gone.begin(), gone.end());
  map.changes.insert(map.changes.end(), report.changes.begin(), report.changes.end());
  for (Correction& correction : map.graph.corrections) {
    correction.object = survivorOf(map, correction.object);
    correction.other = survivorOf(map, correction.other);
  }
  return report;
}

std::vector<std::vector<WorldId>> partsOf(const MapContents& map) {
  const MapState state(Parameters(), map.graph);
  std::map<AnchorId, std::size_t> anchors;
  std::map<AnchorId, std::vector<WorldId>> sessions;
  const auto components = componentsOf(state.graph());
  for (const auto& [anchor, component] : components) ++anchors[component];
  for (const Session& session : sessionsOf(map.graph)) {
    sessions[components.at(session.anchors.front())].push_back(session.world);
  }
  std::vector<std::pair<std::size_t, AnchorId>> order;
  for (const auto& [component, count] : anchors) order.emplace_back(count, component);
  std::sort(order.begin(), order.end(), [](const auto& a, const auto& b) {
    return a.first > b.first || (a.first == b.first && a.second < b.second);
  });
  std::vector<std::vector<WorldId>> parts;
  for (const auto& [count, component] : order) {
    if (!sessions[component].empty()) parts.push_back(sessions[component]);
  }
  return parts;
}

}  // namespace perdure::mapping
