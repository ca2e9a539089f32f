// Targets: the content of the map file. Beliefs and parts of the graph are blobs; the whole graph
// is a set of rows; the place on Earth is a text.
#include "common/earth/earth_place.h"
#include "common/mapping/mapper.h"
#include "services/map_store/core/belief_codec.h"
#include "services/map_store/core/earth_anchor.h"
#include "services/map_store/core/graph/graph_answer.h"
#include "services/map_store/core/graph/graph_tables.h"
#include "tests/common/wire/examples.h"
#include "tests/fuzz/target.h"
#include "tests/services/map_store/graphs.h"

namespace perdure::fuzz {
namespace {

using namespace map_store;  // NOLINT
using fuzz::Bytes;

bool takeBelief(View bytes) {
  const auto belief = decodeBelief(bytes);
  if (!belief) return false;
  require(decodeBelief(encodeBelief(*belief)).has_value(), "a belief reads back");
  return true;
}

bool takeHeader(View bytes) {
  const auto header = decodeHeader(bytes);
  if (!header) return false;
  require(decodeHeader(encodeHeader(*header)).has_value(), "a header reads back");
  return true;
}

std::vector<Bytes> beliefs() {
  std::vector<Bytes> seeds;
  for (const unsigned seed : {1U, 2U, 3U}) {
    seeds.push_back(encodeBelief(wire::Examples(seed).belief()));
  }
  return seeds;
}

std::vector<Bytes> headers() {
  Objects objects;
  wire::Examples(4).fill(objects);
  return {encodeHeader(objects)};
}

/// The first byte selects the kind: an anchor, an edge, a sighting or a view.
bool takePart(View bytes) {
  if (bytes.empty()) return false;
  const View blob = bytes.subspan(1);
  const auto isTaken = [&](auto decode, auto encode) {
    const auto value = decode(blob);
    if (!value) return false;
    require(isSound(*value), "what was taken is sound");
    require(decode(encode(*value)).has_value(), "a part of the graph reads back");
    return true;
  };
  switch (bytes[0] % 4) {
    case 0:
      return isTaken(decodeAnchor, encodeAnchor);
    case 1:
      return isTaken(decodeEdge, encodeEdge);
    case 2:
      return isTaken(decodeRecord, encodeRecord);
    default:
      return isTaken(decodeView, encodeView);
  }
}

std::vector<Bytes> parts() {
  const auto map = map_store::test::RandomGraph(1).map({});
  std::vector<Bytes> seeds;
  for (const std::uint64_t id : {1U, 2U, 3U}) {
    seeds.push_back(encodeAnchor(map.anchors.at(id).anchor));
    seeds.push_back(encodeEdge(map.edges.at(id).edge));
    seeds.push_back(encodeRecord(map.records.at(id)));
    seeds.push_back(encodeView(std::next(map.views.begin(), static_cast<int>(id))->second));
  }
  for (std::size_t i = 0; i < seeds.size(); ++i) {
    seeds[i].insert(seeds[i].begin(), static_cast<std::uint8_t>(i % 4));
  }
  return seeds;
}

// A whole graph: rows of its tables, each a byte that says which table, one for its id, two for the
// length of what follows: the text or blob, of edges behind the weight, of poses four numbers and
// whether it is held fast, of facts the two tracks.

enum class Table : std::uint8_t {
  kClass,
  kAnchor,
  kPose,
  kEdge,
  kSighting,
  kTrack,
  kFact,
  kView,
  kCount
};

constexpr const char* kInsert[] = {"REPLACE INTO graph_classes VALUES(?1, CAST(?2 AS TEXT))",
                                   "REPLACE INTO anchors VALUES(?1, 0, 0, 0, 0, 0, 0, 0, ?2)",
                                   "REPLACE INTO anchor_poses VALUES(?1, ?3, ?4, ?5, ?6, ?7)",
                                   "REPLACE INTO edges VALUES(?1, 0, 0, 0, ?3, ?2)",
                                   "REPLACE INTO sightings VALUES(?1, 0, 0, 0, 0, 0, 0, 0, 0, ?2)",
                                   "REPLACE INTO track_sightings VALUES(?1, 1, 0, ?2)",
                                   "REPLACE INTO same VALUES(?1, ?3, ?4)",
                                   "REPLACE INTO views VALUES(?1, ?2)"};

const Connection& emptyFile() {
  static const Connection file = [] {
    auto made = Connection::open(":memory:", Connection::Mode::kReadWriteCreate);
    require(made && made->execute(kGraphSchema) && made->execute(kAddedSchema) &&
                made->execute("PRAGMA user_version = 4"),
            "there is a file");
    return *std::move(made);
  }();
  return file;
}

double takeDouble(View& from) {
  double value = 0.0;
  if (from.size() < sizeof value) return value;
  std::copy_n(from.begin(), sizeof value, reinterpret_cast<std::uint8_t*>(&value));
  from = from.subspan(sizeof value);
  return value;
}

void insertRow(std::vector<Statement>& statements, Table table, std::uint64_t id, View content) {
  Statement& row = statements[static_cast<std::size_t>(table)];
  row.bind(1, id);
  const int numbers = table == Table::kPose   ? 4
                      : table == Table::kFact ? 2
                      : table == Table::kEdge ? 1
                                              : 0;
  for (int i = 0; i < numbers; ++i) row.bind(3 + i, takeDouble(content));
  if (table == Table::kPose) {
    row.bind(7, std::int64_t{!content.empty() && content[0] != 0});
  } else if (table != Table::kFact) {
    row.bind(2, content);
  }
  (void)row.run();  // the row is missing if a column has an invalid value
}

void fill(View bytes) {
  static std::vector<Statement> statements = [] {
    std::vector<Statement> list;
    for (const char* sql : kInsert) list.push_back(emptyFile().prepare(sql).value());
    return list;
  }();
  while (bytes.size() >= 4) {
    const auto table = static_cast<Table>(bytes[0] % static_cast<std::uint8_t>(Table::kCount));
    const std::uint64_t id = bytes[1] == 255 ? ~std::uint64_t{0} : bytes[1];
    const std::size_t stated = bytes[2] + 256U * bytes[3];
    const std::size_t length = std::min(stated, bytes.size() - 4);
    insertRow(statements, table, id, bytes.subspan(4, length));
    bytes = bytes.subspan(4 + length);
  }
}

/// Uses the graph as map_store does: a mapper continues from it, and answers queries about it.
void tell(const mapping::SavedMap& map) {
  mapping::Mapper mapper({}, map);
  std::set<std::pair<std::uint64_t, std::uint32_t>> sessions;
  for (const auto& [id, saved] : map.anchors) {
    sessions.emplace(saved.anchor.session.world, saved.anchor.session.epoch);
  }
  for (const auto& [world, epoch] : sessions) {
    MapQuery query;
    query.kind = MapQueryKind::kGraph;
    MapReply reply;
    putGraph(mapper, {}, {world, epoch}, query, reply);
    require(!reply.anchors.empty() && reply.anchors.size() <= map.anchors.size(),
            "a session's anchors are told");
  }
}

bool takeGraph(View bytes) {
  const auto begun = Transaction::begin(emptyFile());  // rolled back at the end
  fill(bytes);
  const auto graph = readGraph(emptyFile());
  require(graph.has_value(), "a graph is read, whatever rows it has");
  for (const auto& [id, saved] : graph->map.edges) {
    require(graph->map.anchors.contains(saved.edge.a) && graph->map.anchors.contains(saved.edge.b),
            "an edge has its ends");
  }
  for (const mapping::SameObject& fact : graph->map.facts) {
    require(fact.a != 0 && fact.b != 0 && fact.a != fact.b, "a fact joins two tracks");
    require(fact.loop == 0 || graph->map.edges.contains(fact.loop), "a fact has its loop");
  }
  tell(graph->map);
  require(attempt([] { sweepGraph(emptyFile()); }).has_value(), "a graph is swept");
  const auto swept = readGraph(emptyFile());
  require(swept && swept->malformed == 0, "what is swept is whole");
  require(map_store::test::bitsOf(swept->map) == map_store::test::bitsOf(graph->map),
          "and the rest as it was");
  return graph->malformed == 0 && !graph->map.anchors.empty();
}

void put(Bytes& to, Table table, std::uint64_t id, const Bytes& content) {
  to.push_back(static_cast<std::uint8_t>(table));
  to.push_back(static_cast<std::uint8_t>(id));
  to.push_back(static_cast<std::uint8_t>(content.size() % 256));
  to.push_back(static_cast<std::uint8_t>(content.size() / 256));
  to.insert(to.end(), content.begin(), content.end());
}

Bytes bytesOfNumbers(std::initializer_list<double> numbers) {
  Bytes bytes;
  for (const double number : numbers) {
    const auto* from = reinterpret_cast<const std::uint8_t*>(&number);
    bytes.insert(bytes.end(), from, from + sizeof number);
  }
  return bytes;
}

Bytes graphSeed(std::uint32_t seed, const map_store::test::GraphSize& size) {
  const auto map = map_store::test::RandomGraph(seed).map(size);
  Bytes bytes;
  std::uint64_t number = 0;
  for (const auto& name : map.classes) put(bytes, Table::kClass, number++, bytesOf(name));
  for (const auto& [id, saved] : map.anchors) {
    put(bytes, Table::kAnchor, id, encodeAnchor(saved.anchor));
    const auto& T_MA = saved.T_MA;
    Bytes pose = bytesOfNumbers({T_MA.p.x(), T_MA.p.y(), T_MA.p.z(), T_MA.yaw});
    pose.push_back(saved.held_fast ? 1 : 0);
    put(bytes, Table::kPose, id, pose);
  }
  for (const auto& [id, saved] : map.edges) {
    Bytes edge = bytesOfNumbers({saved.weight});
    const Bytes blob = encodeEdge(saved.edge);
    edge.insert(edge.end(), blob.begin(), blob.end());
    put(bytes, Table::kEdge, id, edge);
  }
  for (const auto& [id, r] : map.records) put(bytes, Table::kSighting, id, encodeRecord(r));
  for (const auto& [id, r] : map.tracks) put(bytes, Table::kTrack, id, encodeRecord(r));
  for (const auto& fact : map.facts) {
    put(bytes, Table::kFact, fact.loop,
        bytesOfNumbers({static_cast<double>(fact.a), static_cast<double>(fact.b)}));
  }
  for (const auto& [id, view] : map.views) put(bytes, Table::kView, id, encodeView(view));
  return bytes;
}

std::vector<Bytes> graphs() {
  return {graphSeed(
              1, {.anchors = 3, .edges = 2, .records = 2, .sessions = 1, .shared = 1, .views = 1}),
          graphSeed(
              2, {.anchors = 6, .edges = 6, .records = 3, .sessions = 2, .shared = 0, .views = 0})};
}

bool takeEarthAnchor(View bytes) {
  const auto anchor = earthAnchorFrom(textOf(bytes));
  if (anchor.empty()) return false;
  require(isEarthAnchor(anchor), "a place that was read is on Earth");
  return true;
}

std::vector<Bytes> earthAnchors() {
  const GeoAnchor anchor{{}, 47.28, 8.56, 547.6, 0.3};
  return {bytesOf(earthAnchorOfMap(
      anchor, RigidTransform(Eigen::Quaterniond::Identity(), Eigen::Vector3d(10.0, -20.0, 1.0))))};
}

}  // namespace

std::vector<Target> mapTargets() {
  return {{"map_belief", 18000, beliefs, takeBelief},
          {"map_header", 9000, headers, takeHeader},
          {"map_graph_parts", 18000, parts, takePart},
          {"map_graph", 1800, graphs, takeGraph},
          {"map_earth_anchor", 18000, earthAnchors, takeEarthAnchor}};
}

}  // namespace perdure::fuzz
