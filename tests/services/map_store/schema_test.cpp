#include "services/map_store/core/schema.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/base/errors.h"
#include "services/map_store/core/map_database.h"
#include "tests/services/map_store/beliefs.h"
#include "tests/services/map_store/graphs.h"

namespace perdure::map_store {
namespace {

using test::carAt;
using test::TemporaryFolder;
using test::workingSet;
using ::testing::HasSubstr;

void fill(const std::string& path, int count) {
  MapDatabase database({path});
  std::vector<ObjectBelief> cars;
  for (int i = 1; i <= count; ++i) cars.push_back(carAt(static_cast<ObjectId>(i), {i * 1.0, 0, 0}));
  const Objects objects = workingSet(1, cars);
  ASSERT_TRUE(database.write({&objects, {}, {}}).has_value());
}

void overwrite(const std::string& path, std::streamoff from, std::size_t count, char with) {
  std::fstream file(path, std::ios::binary | std::ios::in | std::ios::out);
  file.seekp(from);
  file << std::string(count, with);
}

template <class Act>
StartupError refusalOf(Act act) {
  try {
    act();
  } catch (const StartupError& error) {
    return error;
  }
  ADD_FAILURE() << "it was not refused";
  return {ExitCode::kOk, ""};
}

TEST(Schema, MakesTheFolderAndTheFile) {
  const TemporaryFolder folder;
  const std::string path = folder.file("a/b/map.sqlite");
  EXPECT_TRUE(openStore({path}).notice.empty());
  EXPECT_TRUE(std::filesystem::exists(path));
}

TEST(Schema, WritesAheadAndSyncsEveryCommit) {
  const TemporaryFolder folder;
  const auto opened = openStore({folder.file("map.sqlite")});
  auto mode = opened.connection.prepare("PRAGMA journal_mode");
  ASSERT_TRUE(mode.has_value());
  ASSERT_TRUE(mode->step().value());
  EXPECT_EQ(mode->text(0), "wal");
  EXPECT_EQ(opened.connection.integer("PRAGMA synchronous").value(), 2);
}

TEST(Schema, SetsADamagedFileAsideAndKeepsItsBytes) {
  const TemporaryFolder folder;
  const std::string path = folder.file("map.sqlite");
  fill(path, 200);
  overwrite(path, 4096, 8192, '\x5a');
  const auto size = std::filesystem::file_size(path);
  const auto opened = openStore({path});
  EXPECT_THAT(opened.notice, HasSubstr(path + ".damaged-1"));
  EXPECT_THAT(opened.notice, HasSubstr(".recover"));
  EXPECT_EQ(std::filesystem::file_size(path + ".damaged-1"), size);
  EXPECT_EQ(opened.connection.integer("SELECT count(*) FROM objects").value(), 0);
}

TEST(Schema, NeverOverwritesAnEarlierDamagedFile) {
  const TemporaryFolder folder;
  const std::string path = folder.file("map.sqlite");
  for (int round = 1; round <= 2; ++round) {
    fill(path, 50);
    overwrite(path, 0, 512, '\0');
    EXPECT_THAT(openStore({path}).notice, HasSubstr(".damaged-" + std::to_string(round)));
  }
  EXPECT_TRUE(std::filesystem::exists(path + ".damaged-1"));
  EXPECT_TRUE(std::filesystem::exists(path + ".damaged-2"));
}

TEST(Schema, RefusesAnotherProgramsDatabaseAndLeavesItAlone) {
  const TemporaryFolder folder;
  const std::string path = folder.file("other.sqlite");
  {
    const auto other = Connection::open(path, Connection::Mode::kReadWriteCreate);
    ASSERT_TRUE(other->execute("CREATE TABLE t(a); INSERT INTO t VALUES(7)").has_value());
  }
  const auto refusal = refusalOf([&] { openStore({path}); });
  EXPECT_EQ(refusal.code(), ExitCode::kConfiguration);
  EXPECT_THAT(refusal.what(), HasSubstr("store.path"));
  const auto other = Connection::open(path, Connection::Mode::kReadOnly);
  EXPECT_EQ(other->integer("SELECT a FROM t").value(), 7);
}

TEST(Schema, RefusesAFileThatIsNoDatabaseAndLeavesItAlone) {
  const TemporaryFolder folder;
  const std::string path = folder.file("notes.txt");
  std::ofstream(path) << "Dear diary, today I saw a white van behind a lorry.";
  EXPECT_EQ(refusalOf([&] { openStore({path}); }).code(), ExitCode::kConfiguration);
  EXPECT_EQ(std::filesystem::file_size(path), 51u);
}

TEST(Schema, RefusesAMapOfANewerVersion) {
  const TemporaryFolder folder;
  const std::string path = folder.file("map.sqlite");
  fill(path, 1);
  {
    const auto connection = Connection::open(path, Connection::Mode::kReadWriteCreate);
    ASSERT_TRUE(connection->execute("PRAGMA user_version=99").has_value());
  }
  EXPECT_THAT(refusalOf([&] { openStore({path}); }).what(), HasSubstr("schema 99"));
}

/// The tables of schema 2 as Perdure created them.
constexpr char kSecondSchema[] = R"sql(
CREATE TABLE meta(key TEXT PRIMARY KEY, value) WITHOUT ROWID;
CREATE TABLE objects(
  id INTEGER PRIMARY KEY, world INTEGER NOT NULL, epoch INTEGER NOT NULL,
  class TEXT NOT NULL, class_probability REAL NOT NULL, existence REAL NOT NULL,
  x REAL NOT NULL, y REAL NOT NULL, z REAL NOT NULL, yaw REAL NOT NULL,
  length REAL NOT NULL, width REAL NOT NULL, height REAL NOT NULL,
  first_seen_ns INTEGER NOT NULL, last_seen_ns INTEGER NOT NULL, hits INTEGER NOT NULL,
  visibility INTEGER NOT NULL, memory INTEGER NOT NULL,
  tile_x INTEGER NOT NULL, tile_y INTEGER NOT NULL,
  gone INTEGER NOT NULL DEFAULT 0, gone_ns INTEGER, merged_into INTEGER,
  belief BLOB NOT NULL);
CREATE INDEX objects_by_class ON objects(class);
CREATE INDEX objects_by_tile ON objects(tile_x, tile_y);
CREATE VIRTUAL TABLE positions USING rtree(id, x0, x1, y0, y1, z0, z1);
CREATE TABLE working(position INTEGER PRIMARY KEY, id INTEGER NOT NULL, belief BLOB);
PRAGMA application_id=1346720324; PRAGMA user_version=2; PRAGMA journal_mode=WAL;
)sql";

/// Creates a map of schema 1 or 2 with `count` objects.
void makeOlder(const std::string& path, std::int64_t count, int version) {
  const auto connection = Connection::open(path, Connection::Mode::kReadWriteCreate);
  ASSERT_TRUE(connection->execute(kSecondSchema).has_value());
  ASSERT_TRUE(connection->execute("PRAGMA user_version=" + std::to_string(version)).has_value());
  auto insert = connection->prepare(
      "INSERT INTO objects VALUES(?1,77,1,'car',0.9,0.97,?1,0,0,0.3,4.2,1.7,1.5,1,2,7,0,0,0,0,"
      "0,NULL,NULL,?2)");
  ASSERT_TRUE(insert.has_value()) << insert.error().detail;
  for (std::int64_t id = 1; id <= count; ++id) {
    const auto belief = encodeBelief(carAt(static_cast<ObjectId>(id), {1.0 * double(id), 0, 0}));
    insert->bind(1, id).bind(2, std::span<const std::uint8_t>(belief));
    ASSERT_TRUE(insert->run().has_value());
  }
  ASSERT_TRUE(connection
                  ->execute("INSERT INTO positions SELECT id, x, x, y, y, z, z FROM objects;"
                            "INSERT INTO meta VALUES('tile_size_m', '32.000000')")
                  .has_value());
}

std::int64_t versionOf(const std::string& path) {
  return openStoreForReading(path).integer("PRAGMA user_version").value();
}

TEST(Schema, TakesOverMapsOfOlderVersionsWithAllTheirObjects) {
  for (const int version : {1, 2}) {
    const TemporaryFolder folder;
    const std::string path = folder.file("map.sqlite");
    makeOlder(path, 60, version);
    {
      const Connection reading = openStoreForReading(path);
      const MapReader reader(&reading);
      EXPECT_EQ(reader.beliefs().value().size(), 60u);
      EXPECT_TRUE(reader.graph().value().map.anchors.empty());
    }
    EXPECT_EQ(versionOf(path), version);  // reading does not change the version
    MapDatabase database({path});
    EXPECT_TRUE(database.notice().empty());
    EXPECT_EQ(versionOf(path), 4);
    const auto beliefs = database.reader().beliefs().value();
    ASSERT_EQ(beliefs.size(), 60u);
    EXPECT_EQ(encodeBelief(beliefs[6].belief), encodeBelief(carAt(7, {7, 0, 0})));
    EXPECT_TRUE(database.takeGraph().value().map.anchors.empty());
    const mapping::Unsaved graph{test::RandomGraph(1).map({}), {}, {}};
    const Objects objects = workingSet(1, {});
    Batch batch{&objects, {}, {}};
    batch.graph = batch.facts = &graph;
    ASSERT_TRUE(database.write(batch).has_value());
    EXPECT_TRUE(test::bitsOf(database.reader().graph().value().map) == test::bitsOf(graph.changed));
  }
}

/// Creates a map of schema 3: object 9 was merged into 3, and the map could undo this.
void makeThird(const std::string& path) {
  {
    MapDatabase database({path});
    const mapping::Unsaved graph{test::RandomGraph(1).map({.shared = 0}), {}, {}};
    const Objects objects = workingSet(1, {carAt(3, {1, 2, 0}), carAt(9, {8, 2, 0})});
    Batch batch{&objects, {}, {}};
    batch.graph = &graph;
    ASSERT_TRUE(database.write(batch).has_value());
    const Objects merged = workingSet(2, {carAt(3, {1, 2, 0})});
    const Removal into{EventKind::kMerged, fromNanoseconds(200'000'000), 3};
    ASSERT_TRUE(database.write({&merged, {}, {{9, into}}}).has_value());
  }
  const auto connection = Connection::open(path, Connection::Mode::kReadWriteCreate);
  const auto done = connection->execute(
      "DROP TABLE same; DROP TABLE tracks; DROP TABLE track_sightings;"
      "CREATE TABLE merges(absorbed INTEGER PRIMARY KEY, survivor INTEGER NOT NULL,"
      "  loop INTEGER NOT NULL, done INTEGER NOT NULL, undo BLOB NOT NULL, world INTEGER,"
      "  epoch INTEGER, belief BLOB);"
      "INSERT INTO merges SELECT 9, 3, 60, 1, x'0100', world, epoch, belief FROM objects"
      "  WHERE id = 3;"
      "PRAGMA user_version=3");
  ASSERT_TRUE(done.has_value()) << done.error().detail;
}

TEST(Schema, TakesOverAMapOfTheThirdVersionWhoseMergesAreFinal) {
  const TemporaryFolder folder;
  const std::string path = folder.file("map.sqlite");
  makeThird(path);
  std::string graph_as_it_was;
  {
    const Connection reading = openStoreForReading(path);
    const MapReader reader(&reading);
    EXPECT_EQ(reader.beliefs().value().size(), 1u);
    const auto graph = reader.graph().value();
    EXPECT_EQ(graph.malformed, 0u);
    EXPECT_TRUE(graph.map.tracks.empty() && graph.map.facts.empty());
    EXPECT_EQ(reader.working().value()->objects.size(), 1u);
    graph_as_it_was = test::bitsOf(graph.map);
  }
  EXPECT_EQ(versionOf(path), 3);  // reading does not change the version
  MapDatabase database({path});
  EXPECT_EQ(versionOf(path), 4);
  const MapReader reader = database.reader();
  EXPECT_TRUE(test::bitsOf(database.takeGraph().value().map) == graph_as_it_was);
  EXPECT_TRUE(reader.facts().value().empty());
  const auto beliefs = reader.beliefs().value();
  ASSERT_EQ(beliefs.size(), 1u);
  EXPECT_EQ(encodeBelief(beliefs[0].belief), encodeBelief(carAt(3, {1, 2, 0})));
  EXPECT_THAT(reader.mergedInto(3).value(), ::testing::ElementsAre(9u));
  EXPECT_EQ(openStoreForReading(path)
                .integer("SELECT count(*) FROM sqlite_master WHERE name = 'merges'")
                .value(),
            0);
  // It continues: a loop closure is retracted, and no object is separated.
  const mapping::Unsaved withdrawn{{}, {60}, {}};
  const Objects objects = workingSet(3, {carAt(3, {1, 2, 0})});
  const mapping::Identity identity;
  Batch batch{&objects, {}, {}};
  batch.graph = batch.facts = &withdrawn;
  batch.identity = &identity;
  ASSERT_TRUE(database.write(batch).has_value());
  EXPECT_EQ(reader.beliefs().value().size(), 1u);
}

TEST(Schema, LeavesAnOlderMapAsItWasWhereItCannotBeTakenOver) {
  const TemporaryFolder folder;
  const std::string path = folder.file("map.sqlite");
  makeOlder(path, 400, 2);
  {
    // No page is free within 1 MiB, and the tables of the graph need some.
    const auto connection = Connection::open(path, Connection::Mode::kReadWriteCreate);
    ASSERT_TRUE(connection->execute("CREATE TABLE filler(x)").has_value());
    const auto page = connection->integer("PRAGMA page_size").value();
    while (connection->integer("PRAGMA page_count").value() < (1 << 20) / page) {
      ASSERT_TRUE(connection->execute("INSERT INTO filler VALUES(zeroblob(3000))").has_value());
    }
    ASSERT_EQ(connection->integer("PRAGMA freelist_count").value(), 0);
  }
  const auto refusal = refusalOf([&] { openStore({path, 32.0, 1}); });
  EXPECT_EQ(refusal.code(), ExitCode::kInputOutput);
  EXPECT_THAT(refusal.what(), HasSubstr("disk_full"));
  EXPECT_THAT(refusal.what(), HasSubstr("store.max_size"));
  EXPECT_EQ(versionOf(path), 2);
  const Connection reading = openStoreForReading(path);
  EXPECT_EQ(MapReader(&reading).beliefs().value().size(), 400u);
  EXPECT_EQ(reading.integer("SELECT count(*) FROM sqlite_master WHERE name = 'anchors'").value(),
            0);
  EXPECT_EQ(MapDatabase({path}).reader().beliefs().value().size(), 400u);
}

TEST(Schema, SaysTheFixWhereTheFolderCannotBeMade) {
  const TemporaryFolder folder;
  std::ofstream(folder.file("file")) << "x";
  const auto refusal = refusalOf([&] { openStore({folder.file("file/map.sqlite")}); });
  EXPECT_EQ(refusal.code(), ExitCode::kUnavailable);
  EXPECT_THAT(refusal.what(), HasSubstr("store.path"));
}

TEST(Schema, ReadsBesideARunningWriter) {
  const TemporaryFolder folder;
  const std::string path = folder.file("map.sqlite");
  MapDatabase writer({path});
  const Objects objects = workingSet(1, {carAt(3, {1, 2, 3})});
  ASSERT_TRUE(writer.write({&objects, {}, {}}).has_value());
  const Connection reading = openStoreForReading(path);
  EXPECT_EQ(reading.integer("SELECT id FROM objects").value(), 3);
  EXPECT_THROW(openStoreForReading(folder.file("none.sqlite")), StartupError);
}

}  // namespace
}  // namespace perdure::map_store
