// Runs that start from a stored map (`--map`): refused maps, and a street that is visited again in
// another frame.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "common/base/errors.h"
#include "services/map_store/core/map_database.h"
#include "services/map_store/core/schema.h"
#include "tests/common/replay/tiny_datasets.h"
#include "tests/scenario/scene_cache.h"
#include "tools/evaluate/object_rows.h"
#include "tools/pipeline/pipeline.h"
#include "tools/simulate/simulate.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;
using replay::readText;
using replay::startupErrorOf;
using replay::writeText;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

PipelineOptions tinyOptions(const std::string& name) {
  PipelineOptions options;
  options.data = replay::tinyEuroc(name).string();
  options.odometry = "truth";
  options.detections = "none";
  options.out = (fs::path(options.data) / "out").string();
  return options;
}

void run(const PipelineOptions& options) {
  Pipeline pipeline(options);
  pipeline.run([](const PipelineCounts&) {});
  pipeline.finish();
}

std::string errorOf(const PipelineOptions& options) {
  return startupErrorOf([&] { Pipeline pipeline(options); });
}

map_store::Connection opened(const fs::path& file) {
  auto connection =
      map_store::Connection::open(file.string(), map_store::Connection::Mode::kReadWriteCreate);
  if (!connection) throw StartupError(ExitCode::kUnavailable, connection.error().detail);
  return std::move(*connection);
}

TEST(StoredMap, ThatIsNotThereIsNamedAndTheMapOfTheLastRunStays) {
  auto options = tinyOptions("map_missing");
  run(options);
  const auto kept = readText(fs::path(options.out) / "map.sqlite");
  options.map = (fs::path(options.data) / "none.sqlite").string();
  EXPECT_THAT(errorOf(options), AllOf(HasSubstr("none.sqlite"), HasSubstr("give the file")));
  EXPECT_EQ(readText(fs::path(options.out) / "map.sqlite"), kept);
  EXPECT_FALSE(fs::exists(options.map));
}

TEST(StoredMap, ThatIsNoneIsRefusedAndLeftAlone) {
  auto options = tinyOptions("map_diary");
  const fs::path diary = fs::path(options.data) / "diary.txt";
  writeText(diary, "Dear diary, today I saw a white van behind a lorry.");
  options.map = diary.string();
  EXPECT_THAT(errorOf(options), HasSubstr("diary.txt"));
  EXPECT_EQ(readText(diary), "Dear diary, today I saw a white van behind a lorry.");

  const fs::path other = fs::path(options.data) / "other.sqlite";
  ASSERT_TRUE(opened(other).execute("CREATE TABLE t(a)").has_value());
  options.map = other.string();
  EXPECT_THAT(errorOf(options), HasSubstr("other.sqlite"));
  EXPECT_EQ(opened(other).integer("SELECT count(*) FROM t").value(), 0);
  options.map = options.data;
  EXPECT_THAT(errorOf(options), HasSubstr(options.data)) << "a folder";
}

TEST(StoredMap, OfThisRunItselfIsRefusedAndStays) {
  auto options = tinyOptions("map_own");
  run(options);
  const fs::path own = fs::path(options.out) / "map.sqlite";
  const auto kept = readText(own);
  ASSERT_FALSE(kept.empty());
  options.map = own.string();
  EXPECT_THAT(errorOf(options), AllOf(HasSubstr("this run's own map"), HasSubstr("--out")));
  EXPECT_EQ(readText(own), kept);
  // The link gives the file another name.
  const fs::path link = fs::path(options.data) / "link.sqlite";
  fs::create_symlink(own, link);
  options.map = link.string();
  EXPECT_THAT(errorOf(options), HasSubstr("this run's own map"));
  EXPECT_EQ(readText(own), kept);
}

TEST(StoredMap, OfANewerVersionIsRefused) {
  auto options = tinyOptions("map_newer");
  run(options);
  const fs::path newer = fs::path(options.data) / "newer.sqlite";
  fs::copy_file(fs::path(options.out) / "map.sqlite", newer);
  ASSERT_TRUE(opened(newer).execute("PRAGMA user_version=99").has_value());
  options.map = newer.string();
  EXPECT_THAT(errorOf(options), HasSubstr("99"));
}

TEST(StoredMap, OfAnOlderVersionIsTakenOverInTheCopyAlone) {
  auto options = tinyOptions("map_older");
  run(options);
  const fs::path older = fs::path(options.data) / "older.sqlite";
  fs::copy_file(fs::path(options.out) / "map.sqlite", older);
  {
    const auto connection = opened(older);
    ASSERT_TRUE(
        connection
            .execute("PRAGMA journal_mode=DELETE; DROP VIEW objects_in_map; DROP TABLE sightings; "
                     "DROP TABLE edges;"
                     "DROP TABLE anchor_poses; DROP TABLE anchors; DROP TABLE graph_classes;"
                     "DROP TABLE views; DROP TABLE same; DROP TABLE tracks; "
                     "DROP TABLE track_sightings;"
                     "PRAGMA user_version=2")
            .has_value());
  }
  const auto bytes = readText(older);
  options.map = older.string();
  options.out = (fs::path(options.data) / "second").string();
  run(options);
  EXPECT_EQ(readText(older), bytes);
  EXPECT_EQ(opened(fs::path(options.out) / "map.sqlite").integer("PRAGMA user_version").value(),
            map_store::kSchemaVersion);
}

/// The simulated street: two laps around a block. The first lap creates a map. The second one
/// starts from it, in its own frame, with drift.
class StreetAgain : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    SimulateOptions simulation;  // the scene of the golden run, which is taken if it is there
    simulation.scene = "street";
    simulation.images = false;
    simulation.format = ImageFormat::kJpeg;
    simulation.world.rate_hz = 10.0;
    test::cachedScene({.scene = "street"}, [&simulation](const fs::path& folder) {
      simulation.out = folder;
      simulate(simulation, {});
    });
    folder() = replay::freshFolder("street_again");
    PipelineOptions options;
    options.data = simulation.out.string();
    options.odometry = "truth";
    options.detections = "simulated";
    options.quiet = true;
    options.seconds = kLap_s;
    options.out = (folder() / "one").string();
    run(options);
    given() = readText(folder() / "one/map.sqlite");
    options.seconds.reset();
    options.from = kLap_s;
    options.odometry = "drifting";
    options.assignments = {"drifting.own_frame=true"};
    options.map = (folder() / "one/map.sqlite").string();
    options.out = (folder() / "two").string();
    run(options);
  }

  static fs::path& folder() {
    static fs::path path;
    return path;
  }
  static std::string& given() {
    static std::string bytes;
    return bytes;
  }
  static std::set<ObjectId> idsOf(const fs::path& run) {
    std::set<ObjectId> ids;
    const auto connection = map_store::openStoreForReading((run / "map.sqlite").string());
    const auto beliefs = map_store::MapReader(&connection).beliefs();
    for (const auto& placed : beliefs.value()) {
      ids.insert(placed.belief.id);
    }
    return ids;
  }
  static std::vector<nlohmann::json> eventsOf(const fs::path& run, const std::string& kind) {
    std::vector<nlohmann::json> events;
    std::istringstream text(readText(run / "events.jsonl"));
    for (std::string line; std::getline(text, line);) {
      const auto event = nlohmann::json::parse(line);
      if (event.dump().find("\"" + kind + "\"") != std::string::npos) events.push_back(event);
    }
    return events;
  }

  static constexpr double kLap_s = 34.0;
};

TEST_F(StreetAgain, TheGivenFileStaysAsItIs) {
  EXPECT_EQ(readText(folder() / "one/map.sqlite"), given());
  EXPECT_NE(readText(folder() / "two/map.sqlite"), given());
}

TEST_F(StreetAgain, TheBodyIsFoundOnTheMapOnce) {
  EXPECT_EQ(eventsOf(folder() / "one", "relocalised").size(), 0u);
  EXPECT_EQ(eventsOf(folder() / "two", "relocalised").size(), 1u);
}

TEST_F(StreetAgain, WhatIsSeenAgainHasItsIdAndNoIdIsGivenTwice) {
  const auto before = idsOf(folder() / "one"), after = idsOf(folder() / "two");
  ASSERT_GE(before.size(), 8u);
  const ObjectId largest = *before.rbegin();
  std::set<ObjectId> reported, old;
  for (const auto& row : readObjectRows(folder() / "two/objects_inst.csv")) {
    reported.insert(row.id);
    if (before.contains(row.id)) old.insert(row.id);
  }
  for (const ObjectId id : reported) {
    EXPECT_TRUE(before.contains(id) || id > largest) << id << " was given before";
  }
  std::size_t kept = 0;
  for (const ObjectId id : before) kept += after.contains(id) ? 1u : 0u;
  EXPECT_GE(10 * kept, 9 * before.size()) << "what was known is on the map";
  EXPECT_GE(2 * old.size(), before.size()) << "and is seen under its old id";
  // No known object is on the map a second time.
  EXPECT_LE(after.size(), before.size() + before.size() / 4);
}

TEST_F(StreetAgain, TheSessionsAreOfTwoWorlds) {
  const auto connection = map_store::openStoreForReading((folder() / "two/map.sqlite").string());
  EXPECT_EQ(map_store::MapReader(&connection).worlds().value(), (std::set<std::uint64_t>{1, 2}));
}

/// The second half of a walk through a room, or a walk through another room, starts from the map of
/// the first half. Each has a frame of its own, with drift.
class RoomAgain : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder() = replay::freshFolder("room_again");
    const fs::path room = simulateRoom(1);
    PipelineOptions first = optionsOf(room, "one");
    first.odometry = "truth";
    first.seconds = kHalf_s;
    runNoting(first);
    PipelineOptions again = optionsOf(room, "again"), other = optionsOf(simulateRoom(2), "other");
    again.from = kHalf_s;
    for (PipelineOptions* options : {&again, &other}) {
      options->odometry = "drifting";
      options->assignments = {"drifting.own_frame=true"};
      options->map = (folder() / "one/map.sqlite").string();
      runNoting(*options);
    }
  }

  static void runNoting(const PipelineOptions& options) {
    Pipeline pipeline(options);
    pipeline.run([](const PipelineCounts&) {});
    pipeline.finish();
    doubts()[fs::path(options.out).filename()] = endOfLine(pipeline.doubts());
  }

  static fs::path simulateRoom(std::uint64_t seed) {
    SimulateOptions simulation;
    simulation.scene = "room";
    simulation.seed = seed;
    simulation.images = false;
    simulation.world.rate_hz = 10.0;
    simulation.out = folder() / ("room" + std::to_string(seed));
    simulate(simulation, {});
    return simulation.out;
  }
  static PipelineOptions optionsOf(const fs::path& room, const std::string& name) {
    PipelineOptions options;
    options.data = room.string();
    options.detections = "simulated";
    options.quiet = true;
    options.out = (folder() / name).string();
    return options;
  }
  static fs::path& folder() {
    static fs::path path;
    return path;
  }
  /// The end of each run's last line, by the name of the run.
  static std::map<std::string, std::string>& doubts() {
    static std::map<std::string, std::string> of_runs;
    return of_runs;
  }
  static std::string eventsOf(const char* run) { return readText(folder() / run / "events.jsonl"); }
  static std::size_t knownObjectsOf(const char* run) {
    std::set<ObjectId> known, reported;
    for (const auto& row : readObjectRows(folder() / "one/objects_inst.csv")) known.insert(row.id);
    for (const auto& row : readObjectRows(folder() / run / "objects_inst.csv")) {
      if (known.contains(row.id)) reported.insert(row.id);
    }
    return reported.size();
  }

  static constexpr double kHalf_s = 22.0;
  static constexpr const char* kUnplaced = "not found on the given map";
};

TEST_F(RoomAgain, TheSameRoomIsFoundAndItsObjectsHaveTheirIds) {
  EXPECT_THAT(eventsOf("again"), HasSubstr("relocalised"));
  EXPECT_THAT(doubts().at("again"), Not(HasSubstr(kUnplaced)));
  EXPECT_GE(knownObjectsOf("again"), 15U);
}

TEST_F(RoomAgain, AnotherRoomIsNotFoundAndTheLastLineStatesIt) {
  EXPECT_THAT(eventsOf("other"), Not(HasSubstr("relocalised")));
  EXPECT_THAT(doubts().at("other"), HasSubstr(kUnplaced));
  EXPECT_EQ(knownObjectsOf("other"), 0U);
}

TEST_F(RoomAgain, ARunWithoutAMapStatesNothingOfOne) {
  EXPECT_THAT(doubts().at("one"), Not(HasSubstr(kUnplaced)));
}

}  // namespace
}  // namespace perdure::tools
