#include <algorithm>
#include <cmath>
#include <iterator>
#include <set>
#include <string>
#include <string_view>
#include <utility>

#include "common/base/algorithms/disjoint_sets.h"
#include "services/map_store/core/graph/graph_tables.h"

namespace perdure::map_store {
namespace {

using mapping::AnchorId;
using mapping::SavedMap;

/// Calls `take` for each row. Counts the row as malformed if `take` returns false.
template <class Take>
void takeRows(const Connection& connection, std::string_view sql, std::uint64_t& malformed,
              Take take) {
  need(connection.forRows(sql, [&](const Statement& row) { malformed += take(row) ? 0 : 1; }));
}

/// Reads the class names in the order of their numbers. Leaves out names after a gap or a
/// repetition.
void readClasses(const Connection& connection, SavedGraph& graph) {
  auto& classes = graph.map.classes;
  takeRows(connection, "SELECT number, name FROM graph_classes ORDER BY number", graph.malformed,
           [&](const Statement& row) {
             const auto bytes = row.blob(1);
             const bool next = row.id(0) == classes.size() && bytes.size() <= kLongestText;
             const std::string name(bytes.begin(), next ? bytes.end() : bytes.begin());
             const bool known = std::find(classes.begin(), classes.end(), name) != classes.end();
             if (next && !known) classes.push_back(name);
             return next && !known;
           });
}

/// Returns a NaN if the column has no number, so that the pose is not finite.
double numberAt(const Statement& row, int column) {
  return row.isNumber(column) ? row.real(column) : std::nan("");
}

void readAnchors(const Connection& connection, SavedGraph& graph) {
  takeRows(connection,
           "SELECT a.id, a.anchor, p.x, p.y, p.z, p.yaw, p.held_fast FROM anchors a "
           "LEFT JOIN anchor_poses p ON p.id = a.id ORDER BY a.id",
           graph.malformed, [&](const Statement& row) {
             auto anchor = decodeAnchor(row.blob(1));
             if (!anchor || anchor->id != row.id(0)) return false;
             mapping::SavedAnchor saved;
             saved.anchor = *std::move(anchor);
             saved.T_MA.p = {numberAt(row, 2), numberAt(row, 3), numberAt(row, 4)};
             saved.T_MA.yaw = numberAt(row, 5);
             saved.held_fast = row.integer(6) != 0;
             if (!isSound(saved.T_MA)) return false;
             graph.map.anchors.emplace_hint(graph.map.anchors.end(), row.id(0), std::move(saved));
             return true;
           });
}

void readEdges(const Connection& connection, SavedGraph& graph) {
  takeRows(connection, "SELECT id, edge, weight FROM edges ORDER BY id", graph.malformed,
           [&](const Statement& row) {
             auto edge = decodeEdge(row.blob(1));
             const double weight = numberAt(row, 2);
             if (!edge || row.id(0) == 0 || !std::isfinite(weight)) return false;
             graph.map.edges.emplace_hint(graph.map.edges.end(), row.id(0),
                                          mapping::SavedEdge{*std::move(edge), weight});
             return true;
           });
}

void readRecords(const Connection& connection, SavedGraph& graph) {
  auto& records = graph.map.records;
  takeRows(connection, "SELECT id, record FROM sightings ORDER BY id", graph.malformed,
           [&](const Statement& row) {
             auto record = decodeRecord(row.blob(1));
             if (!record || row.id(0) == 0) return false;
             records.emplace_hint(records.end(), row.id(0), *std::move(record));
             return true;
           });
}

void readTracks(const Connection& connection, SavedGraph& graph) {
  if (!need(connection.has("track_sightings"))) return;
  auto& tracks = graph.map.tracks;
  takeRows(connection, "SELECT id, confirmed, gone, record FROM track_sightings ORDER BY id",
           graph.malformed, [&](const Statement& row) {
             auto record = decodeRecord(row.blob(3));
             if (!record || row.id(0) == 0) return false;
             record->confirmed = row.integer(1) != 0;
             record->gone = row.integer(2) != 0;
             tracks.emplace_hint(tracks.end(), row.id(0), *std::move(record));
             return true;
           });
}

void readViews(const Connection& connection, SavedGraph& graph) {
  if (!need(connection.has("views"))) return;
  auto& views = graph.map.views;
  takeRows(connection, "SELECT anchor, points FROM views ORDER BY anchor", graph.malformed,
           [&](const Statement& row) {
             auto view = decodeView(row.blob(1));
             if (!view || row.id(0) == 0) return false;
             views.emplace_hint(views.end(), row.id(0), *std::move(view));
             return true;
           });
}

/// Leaves out anchors whose predecessor is missing, and all that follow them.
void leaveOutBrokenChains(SavedGraph& graph) {
  auto& anchors = graph.map.anchors;
  for (auto at = anchors.begin(); at != anchors.end();) {
    const mapping::Anchor& anchor = at->second.anchor;
    const auto previous = anchors.find(anchor.previous);
    const bool whole = anchor.previous == 0 || (previous != anchors.end() &&
                                                previous->second.anchor.session == anchor.session);
    graph.malformed += whole ? 0 : 1;
    at = whole ? std::next(at) : anchors.erase(at);
  }
}

bool isKnown(const mapping::Sighting& sighting, const SavedMap& map) {
  for (const auto& share : sighting.in_anchor.pmf) {
    if (share.name >= map.classes.size()) return false;
  }
  return map.anchors.contains(sighting.anchor);
}

void leaveOutDangling(SavedGraph& graph) {
  SavedMap& map = graph.map;
  graph.malformed += std::erase_if(map.edges, [&](const auto& each) {
    const mapping::Edge& edge = each.second.edge;
    return !map.anchors.contains(edge.a) || !map.anchors.contains(edge.b);
  });
  graph.malformed += std::erase_if(
      map.records, [&](const auto& each) { return !isKnown(each.second.sighting, map); });
  graph.malformed += std::erase_if(
      map.tracks, [&](const auto& each) { return !isKnown(each.second.sighting, map); });
  graph.malformed +=
      std::erase_if(map.views, [&](const auto& each) { return !map.anchors.contains(each.first); });
  for (auto& [id, record] : map.records) {
    if (!record.earlier || isKnown(*record.earlier, map)) continue;
    record.earlier.reset();
    graph.shortened.insert(id);
    ++graph.malformed;
  }
  for (auto& [id, record] : map.tracks) {
    if (!record.earlier || isKnown(*record.earlier, map)) continue;
    record.earlier.reset();
    ++graph.malformed;
  }
}

/// Adds the facts. Those of a loop closure that was left out become final. Sightings of an object
/// without facts get its id as track id, because a map from a server has no facts.
void takeFacts(SavedGraph& graph, const std::set<mapping::SameObject>& facts) {
  SavedMap& map = graph.map;
  for (mapping::SameObject fact : facts) {
    if (fact.loop != 0 && !map.edges.contains(fact.loop)) {
      fact.loop = 0;
      ++graph.malformed;
    }
    map.facts.insert(fact);
  }
  const mapping::Identity identity(map.facts, map.corrections);
  for (auto& [id, record] : map.records) {
    if (identity.isShared(id)) continue;
    record.sighting.in_anchor.id = id;
    if (record.earlier) record.earlier->in_anchor.id = id;
  }
}

/// Fixes the first anchor of each component that has no fixed anchor, because the fixed one or an
/// edge to it may have been left out.
void holdEachComponent(SavedMap& map) {
  DisjointSets<AnchorId> components;
  for (const auto& [id, saved] : map.edges) components.join(saved.edge.a, saved.edge.b);
  std::set<AnchorId> held;
  for (const auto& [id, saved] : map.anchors) {
    if (saved.held_fast) held.insert(components.rootOf(id));
  }
  for (auto& [id, saved] : map.anchors) {
    if (components.rootOf(id) == id && !held.contains(id)) saved.held_fast = true;
  }
}

void readAll(const Connection& connection, SavedGraph& graph) {
  if (need(connection.integer("PRAGMA user_version")) < kFirstSchemaWithGraph) return;
  readClasses(connection, graph);
  readAnchors(connection, graph);
  readEdges(connection, graph);
  readRecords(connection, graph);
  readTracks(connection, graph);
  readViews(connection, graph);
}

}  // namespace

Result<std::set<mapping::SameObject>> readFacts(const Connection& connection) {
  return attempt([&] {
    std::set<mapping::SameObject> facts;
    if (!need(connection.has("same"))) return facts;
    need(connection.forRows("SELECT loop, a, b FROM same", [&](const Statement& row) {
      const mapping::SameObject fact{row.id(0), row.id(1), row.id(2)};
      if (fact.a != 0 && fact.b != 0 && fact.a != fact.b) facts.insert(fact);
    }));
    return facts;
  });
}

Result<std::vector<Correction>> readCorrections(const Connection& connection) {
  return attempt([&] {
    std::vector<Correction> corrections;
    if (!need(connection.has("corrections"))) return corrections;
    need(connection.forRows(
        "SELECT id, kind, object, other, class, nats, author, time_ns, withdrawn FROM corrections "
        "WHERE kind BETWEEN 0 AND 3 ORDER BY id",
        [&](const Statement& row) {
          corrections.push_back({row.id(0), static_cast<CorrectionKind>(row.integer(1)), row.id(2),
                                 row.id(3), row.text(4), row.real(5), row.text(6),
                                 fromNanoseconds(row.integer(7)), row.integer(8) != 0});
        }));
    return corrections;
  });
}

Result<SavedGraph> readGraph(const Connection& connection) {
  return inOneState(connection, [&] {
    SavedGraph graph;
    readAll(connection, graph);
    const auto facts = need(readFacts(connection));
    graph.map.corrections = need(readCorrections(connection));
    leaveOutBrokenChains(graph);
    leaveOutDangling(graph);
    holdEachComponent(graph.map);
    takeFacts(graph, facts);
    return graph;
  });
}

}  // namespace perdure::map_store
