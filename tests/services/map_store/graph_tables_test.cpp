// The pose graph in the map's file: it is restored completely, and damage affects only parts that
// depend on the damaged ones.
#include "services/map_store/core/graph/graph_tables.h"

#include <gtest/gtest.h>

#include <limits>
#include <numbers>

#include "common/mapping/map_state.h"
#include "services/map_store/core/map_database.h"
#include "tests/services/map_store/beliefs.h"
#include "tests/services/map_store/graphs.h"

namespace perdure::map_store {
namespace {

using mapping::Unsaved;
using test::bitsOf;
using test::carAt;
using test::RandomGraph;
using test::workingSet;

class GraphTables : public ::testing::Test {
 protected:
  std::string path() const { return folder_.file("map.sqlite"); }

  Result<Written> write(MapDatabase& database, const Unsaved& graph) {
    const Objects objects = workingSet(++sequence_, {carAt(1, {0, 0, 0})});
    Batch batch{&objects, {}, {}};
    batch.graph = batch.facts = &graph;
    return database.write(batch);
  }
  void write(const Unsaved& graph) {
    MapDatabase database({path()});
    const auto written = write(database, graph);
    ASSERT_TRUE(written.has_value()) << written.error().detail;
  }
  /// Writes a map of forty anchors in two sessions; the second begins at anchor 21.
  mapping::SavedMap writeSome() {
    Unsaved all{RandomGraph(7).map({}), {}, {}};
    write(all);
    return all.changed;
  }
  SavedGraph read() {
    const MapDatabase database({path()});
    auto graph = database.reader().graph();
    EXPECT_TRUE(graph.has_value()) << graph.error().detail;
    return graph ? *graph : SavedGraph{};
  }
  void change(const std::string& sql) {
    const auto connection = Connection::open(path(), Connection::Mode::kReadWriteCreate);
    const auto done = connection->execute(sql);
    ASSERT_TRUE(done.has_value()) << done.error().detail;
  }
  std::int64_t ask(const std::string& sql) {
    return openStoreForReading(path()).integer(sql).value_or(-1);
  }
  static void expectConsistent(const SavedGraph& graph) {
    const auto& map = graph.map;
    for (const auto& [id, saved] : map.anchors) {
      if (saved.anchor.previous == 0) continue;
      ASSERT_TRUE(map.anchors.contains(saved.anchor.previous));
      EXPECT_EQ(map.anchors.at(saved.anchor.previous).anchor.session, saved.anchor.session);
    }
    for (const auto& [id, saved] : map.edges) {
      EXPECT_TRUE(map.anchors.contains(saved.edge.a) && map.anchors.contains(saved.edge.b));
    }
    for (const auto& [id, record] : map.records) {
      EXPECT_TRUE(map.anchors.contains(record.sighting.anchor));
      EXPECT_TRUE(!record.earlier || map.anchors.contains(record.earlier->anchor));
    }
    for (const auto& [id, record] : map.tracks) {
      EXPECT_TRUE(map.anchors.contains(record.sighting.anchor));
      EXPECT_TRUE(!record.earlier || map.anchors.contains(record.earlier->anchor));
    }
    for (const mapping::SameObject& fact : map.facts) {
      EXPECT_TRUE(fact.loop == 0 || map.edges.contains(fact.loop));
    }
  }

 private:
  test::TemporaryFolder folder_;
  std::uint64_t sequence_ = 0;
};

TEST_F(GraphTables, GiveBackEveryBit) {
  for (const std::uint32_t seed : {1u, 2u, 3u}) {
    const test::TemporaryFolder folder;
    const auto map = RandomGraph(seed).map({60, 90, 300, 3});
    {
      MapDatabase database({folder.file("map.sqlite")});
      ASSERT_TRUE(write(database, {map, {}, {}}).has_value());
    }
    MapDatabase database({folder.file("map.sqlite")});
    const auto graph = database.takeGraph();
    ASSERT_TRUE(graph.has_value()) << graph.error().detail;
    EXPECT_EQ(graph->malformed, 0u);
    EXPECT_TRUE(bitsOf(graph->map) == bitsOf(map));
  }
}

TEST_F(GraphTables, AreEmptyInANewMap) {
  EXPECT_TRUE(read().map.anchors.empty());
  EXPECT_EQ(read().malformed, 0u);
}

TEST_F(GraphTables, TakeWhatHasChangedAndKeepTheRest) {
  auto map = writeSome();
  Unsaved more;
  map.classes.push_back("van");
  more.changed.classes = map.classes;
  RandomGraph random(8);
  for (const mapping::AnchorId id : {3u, 9u}) {
    map.anchors.at(id).T_MA = random.pose();
    more.changed.anchors[id] = map.anchors.at(id);
  }
  more.changed.edges[200] = map.edges[200] = random.edge(4, 30, mapping::EdgeKind::kTracking);
  map.edges.at(5).weight = 0.25;
  more.changed.edges[5] = map.edges.at(5);
  more.changed.records[4] = map.records[4] = random.record(4, map);
  more.changed.tracks[4] = map.tracks[4] = random.trackRecord(4, map);
  more.changed.facts = {{200, 4, 60}};
  more.edges_gone = {7, 8};
  more.records_gone = {10, 99, 5000};
  more.tracks_gone = {2, 1002, 5000};
  more.facts_gone = {*map.facts.begin(), {60, 5000, 5001}};
  map.facts.insert({200, 4, 60});
  for (const auto id : more.edges_gone) map.edges.erase(id);
  for (const auto id : more.records_gone) map.records.erase(id);
  for (const auto id : more.tracks_gone) map.tracks.erase(id);
  for (const auto& fact : more.facts_gone) map.facts.erase(fact);
  write(more);
  EXPECT_TRUE(bitsOf(read().map) == bitsOf(map));
}

TEST_F(GraphTables, KeepConfirmedObjectsOnly) {
  const auto map = writeSome();
  Unsaved more;
  more.changed.classes = map.classes;
  more.changed.records[500] = map.records.at(1);
  more.changed.records[500].confirmed = false;
  MapDatabase database({path()});
  EXPECT_EQ(write(database, more).value().unsound, 0u);
  EXPECT_FALSE(read().map.records.contains(500));
}

TEST_F(GraphTables, LeaveAsItIsStoredWhatIsNotFinite) {
  const auto map = writeSome();
  Unsaved more{map, {}, {}};
  more.changed.anchors.at(2).T_MA.yaw = std::numeric_limits<double>::quiet_NaN();
  more.changed.edges.at(3).weight = std::numeric_limits<double>::infinity();
  more.changed.records.at(4).sighting.in_anchor.p.x() = std::numeric_limits<double>::quiet_NaN();
  MapDatabase database({path()});
  EXPECT_EQ(write(database, more).value().unsound, 3u);
  EXPECT_TRUE(bitsOf(read().map) == bitsOf(map));
}

TEST_F(GraphTables, LoseTheSightingOfAnObjectThatIsGone) {
  writeSome();
  {
    MapDatabase database({path()});
    const Objects objects = workingSet(9, {});
    ASSERT_TRUE(
        database.write({&objects, {}, {{1, {EventKind::kGone, fromNanoseconds(2'000'000'000), 0}}}})
            .has_value());
  }
  EXPECT_FALSE(read().map.records.contains(1));
  EXPECT_EQ(read().map.records.size(), 99u);
}

TEST_F(GraphTables, AnswerWhereObjectsLieInTheMap) {
  Unsaved graph{RandomGraph(7).map({}), {}, {}};
  auto& record = graph.changed.records.at(1);
  record.sighting.anchor = 2;
  record.sighting.in_anchor.p = {2.0, 1.0, 0.5};
  record.sighting.in_anchor.yaw = 0.25;
  graph.changed.anchors.at(2).T_MA = {{10.0, 20.0, 30.0}, std::numbers::pi / 2};
  write(graph);
  const auto connection = openStoreForReading(path());
  auto row = connection.prepare("SELECT id, class, x, y, z, yaw FROM objects_in_map");
  ASSERT_TRUE(row.has_value()) << row.error().detail;
  ASSERT_TRUE(row->step().value());
  EXPECT_EQ(row->integer(0), 1);
  EXPECT_EQ(row->text(1), "car");
  EXPECT_NEAR(row->real(2), 9.0, 1e-12);
  EXPECT_NEAR(row->real(3), 22.0, 1e-12);
  EXPECT_NEAR(row->real(4), 30.5, 1e-12);
  EXPECT_NEAR(row->real(5), 0.25 - std::numbers::pi / 2, 1e-12);
  EXPECT_FALSE(row->step().value());  // no other object is on the map
}

TEST_F(GraphTables, LeaveOutDamagedBlobsOfEdgesAndSightingsAlone) {
  auto map = writeSome();
  change("UPDATE edges SET edge = substr(edge, 1, 40) WHERE id IN (5, 6)");
  change("UPDATE edges SET weight = 'heavy' WHERE id = 7");
  change("UPDATE sightings SET record = x'0100' WHERE id = 12");
  change("UPDATE sightings SET record = zeroblob(3000000) WHERE id = 13");
  const auto graph = read();
  EXPECT_EQ(graph.malformed, 5u);
  for (const mapping::EdgeId id : {5u, 6u, 7u}) map.edges.erase(id);
  for (const ObjectId id : {12u, 13u}) map.records.erase(id);
  // If an edge of the odometry is missing, its component is divided.
  for (const mapping::AnchorId id : {6u, 7u, 8u}) {
    map.anchors.at(id).held_fast = graph.map.anchors.at(id).held_fast;
  }
  EXPECT_TRUE(bitsOf(graph.map) == bitsOf(map));
}

TEST_F(GraphTables, LeaveOutWhatHangsOnADamagedAnchor) {
  for (const char* damage :
       {"UPDATE anchors SET anchor = x'0100ff' WHERE id = 10", "DELETE FROM anchors WHERE id = 10",
        "UPDATE anchor_poses SET x = 'nowhere' WHERE id = 10",
        "DELETE FROM anchor_poses WHERE id = 10"}) {
    std::filesystem::remove(path());
    const auto map = writeSome();
    change(damage);
    const auto graph = read();
    // anchors 1 … 9 and those of the other session remain
    EXPECT_EQ(graph.map.anchors.size(), 29u) << damage;
    EXPECT_FALSE(graph.map.anchors.contains(20));
    expectConsistent(graph);
    std::size_t records = 0, shortened = 0, edges = 0;
    const auto lost = [](mapping::AnchorId id) { return id >= 10 && id <= 20; };
    for (const auto& [id, record] : map.records) {
      const bool kept = !lost(record.sighting.anchor);
      records += kept ? 1 : 0;
      shortened += kept && record.earlier && lost(record.earlier->anchor) ? 1 : 0;
    }
    for (const auto& [id, saved] : map.edges) {
      edges += !lost(saved.edge.a) && !lost(saved.edge.b) ? 1 : 0;
    }
    EXPECT_EQ(graph.map.records.size(), records);
    EXPECT_EQ(graph.shortened.size(), shortened);
    EXPECT_GT(shortened, 0u);
    EXPECT_EQ(graph.map.edges.size(), edges);
  }
}

TEST_F(GraphTables, AViewOfAnAnchorThatIsGoneIsLeftOutAndSwept) {
  writeSome();
  change("DELETE FROM anchors WHERE id = 12");
  change("UPDATE views SET points = x'0100' WHERE anchor = 3");
  const auto graph = read();
  EXPECT_FALSE(graph.map.views.contains(12)) << "its anchor";
  EXPECT_FALSE(graph.map.views.contains(3)) << "its bytes";
  EXPECT_TRUE(graph.map.views.contains(4));
  MapDatabase database({path()});
  (void)database.takeGraph();
  ASSERT_TRUE(write(database, {}).has_value());
  EXPECT_EQ(ask("SELECT count(*) FROM views WHERE anchor IN (3, 12)"), 0);
  EXPECT_EQ(ask("SELECT count(*) FROM views WHERE anchor = 4"), 1);
}

TEST_F(GraphTables, AMapWithoutViewsIsReadAndGivenTheTable) {
  const auto map = writeSome();
  change("DROP TABLE views");
  EXPECT_EQ(read().malformed, 0u) << "a reader does without";
  EXPECT_TRUE(read().map.views.empty());
  Unsaved more;
  more.changed.classes = map.classes;
  more.changed.views = map.views;
  write(more);
  EXPECT_EQ(ask("SELECT count(*) FROM views"), 12);
}

TEST_F(GraphTables, LeaveOutASuccessorOfAnotherSession) {
  auto map = writeSome();
  Unsaved more;
  more.changed.anchors[30] = map.anchors.at(30);
  more.changed.anchors[30].anchor.session.epoch += 1;
  write(more);
  const auto graph = read();
  // anchors 30 … 40 and the parts that depend on them are missing
  EXPECT_EQ(graph.map.anchors.size(), 29u);
  expectConsistent(graph);
}

TEST_F(GraphTables, LeaveOutObjectsOfClassesWhoseNameIsMissing) {
  const auto map = writeSome();
  change("DELETE FROM graph_classes WHERE number = 1");
  const auto graph = read();
  EXPECT_EQ(graph.map.classes, std::vector<std::string>{"car"});
  for (const auto& [id, record] : graph.map.records) {
    for (const auto& share : record.sighting.in_anchor.pmf) EXPECT_EQ(share.name, 0u);
  }
  EXPECT_GT(graph.map.records.size(), 0u);
  EXPECT_LT(graph.map.records.size(), map.records.size());
}

TEST_F(GraphTables, AClassWhoseNameIsThatOfAnotherIsLeftOut) {
  writeSome();
  change("UPDATE graph_classes SET name = 'car'");
  const auto graph = read();
  EXPECT_EQ(graph.map.classes, std::vector<std::string>{"car"});
  EXPECT_GE(graph.malformed, 1u);
  expectConsistent(graph);
  const mapping::MapState state({}, graph.map);
  EXPECT_EQ(state.unsaved().changed.classes, graph.map.classes);
}

TEST_F(GraphTables, AClassOfANumberBelowZeroIsLeftOutAndSwept) {
  const auto map = writeSome();
  change("INSERT INTO graph_classes VALUES(-1, 'ghost')");
  EXPECT_EQ(read().malformed, 1u);
  MapDatabase database({path()});
  (void)database.takeGraph();
  Unsaved more;
  more.changed.classes = map.classes;
  ASSERT_TRUE(write(database, more).has_value());
  EXPECT_EQ(read().malformed, 0u);
  EXPECT_EQ(read().map.classes, map.classes);
}

TEST_F(GraphTables, HoldOneAnchorOfEachComponentFast) {
  writeSome();
  change("UPDATE edges SET edge = x'00' WHERE kind <> 0 OR (a = 5 AND b = 6)");
  const auto graph = read();
  std::vector<mapping::AnchorId> held;
  for (const auto& [id, saved] : graph.map.anchors) {
    if (saved.held_fast) held.push_back(id);
  }
  EXPECT_EQ(held, (std::vector<mapping::AnchorId>{1, 6, 21}));
}

TEST_F(GraphTables, DeleteWhatWasLeftOutBeforeItsIdsAreGivenAgain) {
  writeSome();
  change("DELETE FROM anchors WHERE id = 25");
  MapDatabase database({path()});
  const auto graph = database.takeGraph();
  ASSERT_TRUE(graph.has_value());
  ASSERT_EQ(graph->map.anchors.rbegin()->first, 24u);
  // Another trajectory begins at the next id; no part of the old 25 … 40 may belong to it.
  Unsaved more;
  more.changed.classes = graph->map.classes;
  RandomGraph random(9);
  auto map = graph->map;
  map.anchors[25] = more.changed.anchors[25] = {random.anchor(25, 0), random.pose(), true};
  ASSERT_TRUE(write(database, more).has_value());
  const auto after = read();
  EXPECT_EQ(after.malformed, 0u);
  EXPECT_TRUE(bitsOf(after.map) == bitsOf(map));
}

TEST_F(GraphTables, AreReadAsOneStateBesideAWriter) {
  const auto map = writeSome();
  MapDatabase writer({path()});
  const Connection reading = openStoreForReading(path());
  const MapReader reader(&reading);
  EXPECT_TRUE(bitsOf(reader.graph().value().map) == bitsOf(map));
  Unsaved more;
  more.edges_gone = {1};
  ASSERT_TRUE(write(writer, more).has_value());
  EXPECT_EQ(reader.graph().value().map.edges.size(), map.edges.size() - 1);
}

TEST_F(GraphTables, StayAsTheyWereWhereTheDiskIsFull) {
  const auto map = writeSome();
  const auto objects = ask("SELECT count(*) FROM objects");
  {
    MapDatabase database({path(), 32.0, 1});
    const Unsaved more{RandomGraph(11).map({200, 300, 4000, 2}), {1}, {1}};
    const Objects two = workingSet(3, {carAt(1, {0, 0, 0}), carAt(2, {1, 0, 0})});
    Batch batch{&two, {}, {}};
    batch.graph = &more;
    const auto written = database.write(batch);
    ASSERT_FALSE(written.has_value());
    EXPECT_EQ(written.error().code, "disk_full");
    EXPECT_TRUE(bitsOf(database.reader().graph().value().map) == bitsOf(map));
    Unsaved small;
    small.edges_gone = {1};
    EXPECT_TRUE(write(database, small).has_value());
  }
  EXPECT_EQ(ask("SELECT count(*) FROM objects"), objects);
  EXPECT_EQ(read().map.edges.size(), map.edges.size() - 1);
}

TEST_F(GraphTables, AFactOfALoopThatIsLeftOutStaysForGoodAndIsSwept) {
  auto map = writeSome();
  change("UPDATE edges SET edge = x'00' WHERE id = 60");
  map.edges.erase(60);
  std::set<mapping::SameObject> final;
  for (const auto& fact : map.facts) final.insert({0, fact.a, fact.b});
  ASSERT_NE(map.facts, final);
  EXPECT_EQ(read().map.facts, final);
  MapDatabase database({path()});
  map.facts = database.takeGraph().value().map.facts;
  // Another loop closure gets the id, and its own fact.
  Unsaved more;
  more.changed.classes = map.classes;
  more.changed.edges[60] = map.edges[60] = RandomGraph(8).edge(4, 30, mapping::EdgeKind::kLoop);
  more.changed.facts = {{60, 6, 7}};
  map.facts.insert({60, 6, 7});
  ASSERT_TRUE(write(database, more).has_value());
  EXPECT_EQ(read().malformed, 0u);
  EXPECT_TRUE(bitsOf(read().map) == bitsOf(map));
}

TEST_F(GraphTables, AnEarlierSightingOfATrackFromAnAnchorThatIsGoneIsLeftOutAndSwept) {
  auto map = writeSome();
  map.tracks.at(1).sighting.anchor = 2;
  map.tracks.at(1).earlier = map.tracks.at(1).sighting;
  map.tracks.at(1).earlier->anchor = 40;
  Unsaved more;
  more.changed.classes = map.classes;
  more.changed.tracks[1] = map.tracks.at(1);
  write(more);
  change("DELETE FROM anchors WHERE id = 40");
  ASSERT_TRUE(read().map.tracks.contains(1));
  EXPECT_FALSE(read().map.tracks.at(1).earlier);
  MapDatabase database({path()});
  (void)database.takeGraph();
  Unsaved again;
  again.changed.classes = map.classes;
  again.changed.anchors[40] = map.anchors.at(40);
  ASSERT_TRUE(write(database, again).has_value());
  EXPECT_EQ(read().malformed, 0u);
  EXPECT_FALSE(read().map.tracks.at(1).earlier) << "the new anchor is another one";
}

TEST_F(GraphTables, LeaveOutFactsThatJoinNothing) {
  const auto map = writeSome();
  change("INSERT INTO same VALUES(0, 0, 5), (0, 6, 0), (0, 7, 7), (0, 'six', 8)");
  EXPECT_EQ(read().map.facts, map.facts);
}

TEST_F(GraphTables, AnObjectWithoutFactsGoesOnAsOneTrack) {
  const auto map = writeSome();
  Unsaved more;
  more.changed.classes = map.classes;
  more.changed.records[50] = map.records.at(50);
  more.changed.records[50].sighting.in_anchor.id = 2000;  // its newest track
  write(more);
  EXPECT_EQ(read().map.records.at(50).sighting.in_anchor.id, 50u);
  more.changed.facts = {{0, 50, 2000}};
  write(more);
  EXPECT_EQ(read().map.records.at(50).sighting.in_anchor.id, 2000u);
}

TEST_F(GraphTables, MapsOfTheFirstSchemaFourAreGivenTheTablesOfTracks) {
  const auto map = writeSome();
  change("DROP TABLE same; DROP TABLE track_sightings; DROP TABLE tracks");
  EXPECT_EQ(read().malformed, 0u);
  write({map, {}, {}});
  EXPECT_TRUE(bitsOf(read().map) == bitsOf(map));
}

}  // namespace
}  // namespace perdure::map_store
