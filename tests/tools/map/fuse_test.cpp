// Tests `perdure map fuse` on files: invalid input, the written file, and equal bytes for equal
// maps.
#include "tools/map/fuse.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <CLI/CLI.hpp>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>

#include "common/base/errors.h"
#include "services/map_store/core/map_contents.h"
#include "services/map_store/core/map_database.h"
#include "services/map_store/node.h"
#include "tests/common/mapping/fusion/drives.h"
#include "tests/services/map_store/beliefs.h"
#include "tests/support/corrections.h"
#include "tools/map/map_source.h"

namespace perdure::tools {
namespace {

namespace fs = std::filesystem;
using map_store::test::TemporaryFolder;
using mapping::test::driven;
using ::testing::AllOf;
using ::testing::HasSubstr;

const std::vector<mapping::test::Thing>& things() {
  static const auto all = mapping::test::thingsAlongBlock(3);
  return all;
}

/// Caches the drives, because they take longer than their fusion.
const mapping::MapContents& drivenOnce(const std::string& name,
                                       const mapping::test::DriveSettings& settings) {
  static std::map<std::string, mapping::MapContents> maps;
  const auto known = maps.find(name);
  return known != maps.end() ? known->second : maps[name] = driven(things(), settings).map;
}

class FuseFiles : public ::testing::Test {
 protected:
  std::string write(const std::string& name, const mapping::test::DriveSettings& settings) {
    map_store::WholeMap map;
    map.contents = drivenOnce(name, settings);
    // Some objects are still in the working set, as after a drive.
    for (auto& [id, object] : map.contents.objects) {
      object.belief.visibility = id % 3 == 0 ? Visibility::kVisible : Visibility::kOutOfView;
      object.belief.visible_fraction = id % 3 == 0 ? 0.5 : 0.0;
    }
    map_store::writeWholeMap(map, folder.file(name), false);
    return folder.file(name);
  }
  std::string first() { return write("a.sqlite", {.seed = 1, .to_m = 250.0}); }
  std::string second() {
    return write("b.sqlite", {.seed = 2, .from_m = 130.0, .to_m = 380.0, .clock_s = 1000.0});
  }
  std::string third() {
    return write("c.sqlite", {.seed = 5, .from_m = 250.0, .to_m = 480.0, .clock_s = 2000.0});
  }
  std::string out(const std::string& name = "out.sqlite") { return folder.file(name); }

  TemporaryFolder folder;
};

/// Returns all stored beliefs of a file, with their history columns.
std::vector<std::string> beliefBytes(const std::string& path) {
  const auto connection = map_store::openStoreForReading(path);
  auto rows = connection.prepare(
      "SELECT id, world, gone, coalesce(gone_ns, 0), coalesce(merged_into, 0), belief FROM objects "
      "ORDER BY id");
  std::vector<std::string> all;
  while (*rows->step()) {
    std::string row;
    for (int k = 0; k < 5; ++k) row += std::to_string(rows->integer(k)) + " ";
    const auto blob = rows->blob(5);
    all.push_back(row + std::string(blob.begin(), blob.end()));
  }
  return all;
}

std::string whyRefused(const FuseRequest& request, ExitCode expected) {
  try {
    (void)fuseFiles(request);
  } catch (const StartupError& error) {
    EXPECT_EQ(error.code(), expected) << error.what();
    return error.what();
  }
  ADD_FAILURE() << "not refused";
  return {};
}

TEST_F(FuseFiles, WriteOneMapThatAServiceGoesOnFrom) {
  const FuseOutcome outcome = fuseFiles({{first(), second()}, out()});
  EXPECT_EQ(outcome.parts.size(), 1u);
  EXPECT_GT(outcome.merges(), 5u);
  EXPECT_EQ(outcome.objects, outcome.objectsBefore() - outcome.merges());
  EXPECT_FALSE(fs::exists(out() + ".part") || fs::exists(out() + "-wal"));
  map_store::MapDatabase database(map_store::StoreOptions{.path = out()});
  const auto graph = database.takeGraph();
  ASSERT_TRUE(graph);
  EXPECT_EQ(graph->malformed, 0u);
  EXPECT_EQ(mapping::sessionsOf(graph->map).size(), 2u);
  EXPECT_EQ(database.reader().beliefs()->size(), outcome.objects);
  EXPECT_EQ(graph->map.records.size(), outcome.objects);
  EXPECT_EQ(database.reader().worlds()->size(), 2u);
  EXPECT_EQ(*database.reader().largestId() + 1, (*database.reader().working())->next_id);
}

TEST_F(FuseFiles, TheSameMapAgainIsTheSameToTheByteOfTheBeliefs) {
  const std::string a = first(), b = second();
  (void)fuseFiles({{a, b}, out("ab")});
  (void)fuseFiles({{out("ab"), out("ab")}, out("ab_ab")});
  (void)fuseFiles({{a, b, a}, out("aba")});
  (void)fuseFiles({{out("ab"), a}, out("ab_a")});
  (void)fuseFiles({{b, out("ab"), a}, out("b_ab_a")});
  const auto once = beliefBytes(out("ab"));
  EXPECT_GT(once.size(), 20u);
  EXPECT_TRUE(beliefBytes(out("ab_ab")) == once);
  EXPECT_TRUE(beliefBytes(out("aba")) == once);
  EXPECT_TRUE(beliefBytes(out("ab_a")) == once);
  EXPECT_TRUE(beliefBytes(out("b_ab_a")) == once);
}

TEST_F(FuseFiles, TheOrderOfThreeFilesDoesNotMatter) {
  const std::string a = first(), b = second(), c = third();
  (void)fuseFiles({{a, b, c}, out("abc")});
  (void)fuseFiles({{c, a, b}, out("cab")});
  EXPECT_TRUE(beliefBytes(out("cab")) == beliefBytes(out("abc")));
}

TEST_F(FuseFiles, AFileComesBackAsItWasWritten) {
  const std::string a = first();
  const auto map = map_store::readWholeMap(map_store::openStoreForReading(a));
  ASSERT_TRUE(map);
  EXPECT_EQ(map->malformed, 0u);
  (void)fuseFiles({{a, second()}, out()});
  const auto fused = map_store::readWholeMap(map_store::openStoreForReading(out()));
  ASSERT_TRUE(fused);
  map_store::writeWholeMap(*fused, out("again"), false);
  const auto again = map_store::readWholeMap(map_store::openStoreForReading(out("again")));
  ASSERT_TRUE(again);
  EXPECT_EQ(again->contents.origins, fused->contents.origins);
  EXPECT_FALSE(fused->contents.origins.empty());
  EXPECT_TRUE(beliefBytes(out("again")) == beliefBytes(out()));
}

TEST_F(FuseFiles, RefuseWithTheFix) {
  const std::string a = first();
  EXPECT_THAT(whyRefused({{a, folder.file("nowhere")}, out()}, ExitCode::kUnavailable),
              AllOf(HasSubstr("There is no map"), HasSubstr("nowhere")));
  std::ofstream(folder.file("text")) << "this is no map, but a text that is long enough to be read";
  EXPECT_THAT(whyRefused({{a, folder.file("text")}, out()}, ExitCode::kConfiguration),
              HasSubstr("is not a map of Perdure's"));
  std::ofstream(out("there")) << "mine";
  EXPECT_THAT(whyRefused({{a}, out("there")}, ExitCode::kConfiguration), HasSubstr("--force"));
  EXPECT_THAT(whyRefused({{a}, a, true}, ExitCode::kUsage), HasSubstr("another --out"));
  EXPECT_FALSE(fs::exists(out()) || fs::exists(out() + ".part"));
}

TEST_F(FuseFiles, RefuseAMapOfANewerVersion) {
  const std::string a = first(), b = second();
  {
    const auto connection =
        map_store::Connection::open(b, map_store::Connection::Mode::kReadWriteCreate);
    ASSERT_TRUE(connection->execute("PRAGMA user_version=99"));
  }
  EXPECT_THAT(whyRefused({{a, b}, out()}, ExitCode::kConfiguration),
              AllOf(HasSubstr("schema 99"), HasSubstr("newer Perdure")));
}

TEST_F(FuseFiles, RefuseAMapThatIsDamagedInside) {
  const std::string a = first(), b = second();
  {
    std::fstream file(b, std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(static_cast<std::streamoff>(fs::file_size(b) / 3));
    file << std::string(fs::file_size(b) / 2, '\x5a');
  }
  EXPECT_THAT(whyRefused({{a, b}, out()}, ExitCode::kUnavailable),
              AllOf(HasSubstr("cannot be read"), HasSubstr(".recover")));
  EXPECT_FALSE(fs::exists(out()) || fs::exists(out() + ".part"));
}

/// Networks may use different class names. The classes with common names align the maps.
TEST_F(FuseFiles, MapsOfOtherClassesAreAlignedByThoseInCommon) {
  map_store::WholeMap map;
  map.contents =
      driven(things(), {.seed = 2, .from_m = 130.0, .to_m = 380.0, .clock_s = 1000.0}).map;
  for (auto& [id, object] : map.contents.objects) {
    for (ClassBelief& c : object.belief.classes) c.name = c.name == "van" ? "truck" : c.name;
  }
  for (std::string& name : map.contents.graph.classes) name = name == "van" ? "truck" : name;
  map_store::writeWholeMap(map, folder.file("b.sqlite"), false);
  const FuseOutcome outcome = fuseFiles({{first(), folder.file("b.sqlite")}, out()});
  EXPECT_EQ(outcome.parts.size(), 1u);
  EXPECT_GT(outcome.merges(), 5u);
}

TEST_F(FuseFiles, ReplaceOnlyByForceAndKeepNothingOfTheOldOne) {
  std::ofstream(out()) << "mine";
  std::ofstream(out() + "-wal") << "its log";
  (void)fuseFiles({{first()}, out(), true});
  EXPECT_FALSE(fs::exists(out() + "-wal"));
  EXPECT_GT(beliefBytes(out()).size(), 5u);
}

TEST_F(FuseFiles, AMapWithoutAGraphStaysOutAndIsTold) {
  const std::string a = first();
  {
    map_store::MapDatabase database(map_store::StoreOptions{.path = folder.file("old")});
    const auto objects = map_store::test::workingSet(
        1, {map_store::test::carAt(1, {1, 2, 3}), map_store::test::carAt(2, {5, 2, 3})});
    ASSERT_TRUE(database.write({&objects, {}, {}}));
  }
  const FuseOutcome outcome = fuseFiles({{folder.file("old"), a}, out()});
  EXPECT_EQ(outcome.left_out, std::vector<std::string>{folder.file("old")});
  EXPECT_EQ(outcome.files.size(), 1u);
  CLI::App app;
  addFuseCommand(app);
  std::vector<std::string> arguments{"fuse", folder.file("old"), a, "--out", out(), "--force"};
  std::reverse(arguments.begin(), arguments.end());  // the order that CLI11 expects
  testing::internal::CaptureStdout();
  try {
    app.parse(arguments);
    ADD_FAILURE() << "status 0";
  } catch (const StartupError& error) {
    EXPECT_EQ(error.code(), ExitCode::kFailure);
    EXPECT_THAT(error.what(), AllOf(HasSubstr("without a graph"), HasSubstr("old")));
  }
  EXPECT_THAT(testing::internal::GetCapturedStdout(), HasSubstr("written: "));
}

TEST_F(FuseFiles, AFullDiskLeavesNothingBehind) {
  map_store::WholeMap map;
  map.contents = driven(things(), {.seed = 1, .to_m = 250.0}).map;
  const mapping::StoredObject one = map.contents.objects.begin()->second;
  for (ObjectId id = 1000; id < 6000; ++id) {
    map.contents.objects[id] = one;
    map.contents.objects[id].belief.id = id;
  }
  try {
    map_store::writeWholeMap(map, out(), false, 1);
    ADD_FAILURE() << "it fits";
  } catch (const StartupError& error) {
    EXPECT_THAT(error.what(), AllOf(HasSubstr("disk_full"), HasSubstr("free space")));
  }
  EXPECT_TRUE(fs::is_empty(folder.path()));
}

TEST_F(FuseFiles, TellWhatBecameOfThem) {
  const FuseOutcome outcome = fuseFiles({{first(), second()}, out()});
  EXPECT_THAT(toText(outcome), AllOf(HasSubstr("a.sqlite: 1 sessions"), HasSubstr("objects before"),
                                     HasSubstr("written: ")));
  const auto json = nlohmann::json::parse(toJsonText(outcome));
  EXPECT_EQ(json.at("files").size(), 2u);
  EXPECT_EQ(json.at("merges"), outcome.merges());
  EXPECT_EQ(json.at("parts").at(0).at("sessions").size(), 2u);
  EXPECT_TRUE(json.at("changes").empty());
}

TEST_F(FuseFiles, WhatJoinsNothingIsSaidInOneLine) {
  const auto elsewhere = mapping::test::thingsAlongBlock(77);
  map_store::WholeMap map;
  map.contents = driven(elsewhere, {.seed = 9, .to_m = 150.0, .clock_s = 500.0}).map;
  map_store::writeWholeMap(map, folder.file("far"), false);
  const FuseOutcome outcome = fuseFiles({{first(), folder.file("far")}, out()});
  ASSERT_EQ(outcome.parts.size(), 2u);
  EXPECT_THAT(toText(outcome), HasSubstr("joins nothing yet"));
}

/// Sends a correction to a map_store that has opened the file.
MapReply correct(const std::string& path, const Correction& correction) {
  map_store::Config config;
  config.store_path = path;
  MapReply answer;
  map_store::Node node(config, 5,
                       {.tile = [](const MapTile&) {},
                        .emptied = [](const MapTile&) {},
                        .header = [](const MapHeader&) {},
                        .reply = [&](const MapReply& reply) { answer = reply; },
                        .near = [](const MapNear&) {}});
  node.onCorrection({1, 1, correction});
  EXPECT_TRUE(answer.ok) << answer.error;
  return answer;
}

MapReply allOf(const std::string& path) {
  MapQuery query;
  query.limit = 1000;
  return MapFile(path).ask(query);
}

TEST_F(FuseFiles, CorrectionsBeyondTheLimitAreLeftOutAndCounted) {
  const std::string a = first(), b = second();
  const ObjectId of_b = allOf(b).objects.front().id;
  const auto fill = [](const std::string& path, ObjectId id, std::size_t count) {
    const auto file =
        map_store::Connection::open(path, map_store::Connection::Mode::kReadWriteCreate);
    const auto done = file->execute(fmt::format(
        "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n WHERE i < {}) INSERT INTO "
        "corrections SELECT i, 0, {}, 0, '', 0.001, '{}' || i, 0, 0 FROM n",
        count, id, path));
    ASSERT_TRUE(done.has_value()) << done.error().detail;
  };
  fill(a, allOf(a).objects.front().id, kMostCorrections);
  fill(b, of_b, 3);
  const FuseOutcome outcome = fuseFiles({{a, b}, out()});
  EXPECT_EQ(allOf(out()).corrections.size(), kMostCorrections);
  EXPECT_EQ(outcome.sumOf(&mapping::FusionReport::corrections_left_out), 3u);
  EXPECT_THAT(toText(outcome), HasSubstr("3 corrections are left out, because a map has at most"));
}

TEST_F(FuseFiles, CorrectionsStandInTheFusedMapAndCanBeWithdrawnThere) {
  const std::string a = first(), b = second();
  (void)fuseFiles({{a, b}, out("plain")});
  const auto plain = allOf(out("plain")).objects;
  const ObjectId of_a = allOf(a).objects.front().id, of_b = allOf(b).objects.back().id;
  (void)correct(a, test::notThere(of_a, 3.0, "Ada"));
  const ObjectId other = allOf(b).objects.front().id;
  (void)correct(b, test::ofTwo(CorrectionKind::kDifferent, of_b, other));
  (void)correct(b, test::notThere(of_b, 4.0, "Bo"));
  (void)fuseFiles({{a, b, a}, out()});
  EXPECT_TRUE(beliefBytes(out()) == beliefBytes(out("plain")));
  const MapReply fused = allOf(out());
  ASSERT_EQ(fused.corrections.size(), 3u);
  std::size_t changed = 0;
  for (std::size_t k = 0; k < plain.size(); ++k) {
    const double fall = logOdds(plain[k].existence) - logOdds(fused.objects[k].existence);
    for (const Correction& each : fused.corrections) {
      if (each.aboutTwo() || each.object != plain[k].id) continue;
      ++changed;
      EXPECT_NEAR(fall, each.nats, 1e-9) << each.author;
    }
  }
  EXPECT_EQ(changed, 2u);
  for (const Correction& each : fused.corrections) {
    (void)correct(out(), test::withdrawal(each.id));
  }
  const MapReply after = allOf(out());
  EXPECT_TRUE(after.corrections.empty());
  ASSERT_EQ(after.objects.size(), plain.size());
  for (std::size_t k = 0; k < plain.size(); ++k) {
    EXPECT_EQ(after.objects[k].existence, plain[k].existence);
  }
}

}  // namespace
}  // namespace perdure::tools
