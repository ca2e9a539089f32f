// Maps between files and a server, and the server's geometry and notifications.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <functional>
#include <numbers>
#include <optional>

#include "common/base/errors.h"
#include "common/earth/geodesy.h"
#include "services/map_store/fleet/map_transfer.h"
#include "services/map_store/fleet/server_schema.h"
#include "tests/services/map_store/fleet/files.h"
#include "tests/services/map_store/fleet/postgres_server.h"

namespace perdure::map_store {
namespace {

using test::configOf;
using test::kLong;
using test::quick;
using test::TemporaryFolder;
using test::Vehicle;
using ::testing::HasSubstr;

/// Writes a map with a graph and some objects, as a service or a fusion does.
void writeMap(const std::string& path, std::uint32_t seed, bool outbox = false) {
  MapDatabase database({.path = path, .outbox = outbox});
  mapping::Unsaved graph{test::RandomGraph(seed).map({.shared = 0}), {}, {}};
  std::vector<ObjectBelief> cars;
  for (ObjectId id = 1; id <= 60; ++id) {
    cars.push_back(test::carAt(id, {2.0 * static_cast<double>(id), 5, 0}));
  }
  const Objects objects = test::workingSet(seed, cars);
  Batch batch{&objects, {}, {}};
  batch.graph = &graph;
  ASSERT_TRUE(database.write(batch).has_value());
}

std::string refusalOf(const std::function<void()>& what) {
  try {
    what();
  } catch (const StartupError& error) {
    return error.what();
  }
  return {};
}

TEST(FleetTransfer, AMapThatIsPushedAndPulledIsTheSame) {
  auto* server = PERDURE_SERVER_OR_SKIP();
  const TemporaryFolder folder;
  const std::string url = server->makeDatabase();
  for (const std::uint32_t seed : {5u, 6u}) {  // the second map replaces the first
    const std::string from = folder.file("from-" + std::to_string(seed));
    const std::string to = folder.file("to-" + std::to_string(seed));
    writeMap(from, seed);
    fleet::pushMap(from, url, "town");
    fleet::pullMap(url, "town", to);
    for (const char* table : test::kCommonTables) {
      EXPECT_EQ(test::rowsOf(from, table), test::rowsOf(to, table)) << table;
    }
    EXPECT_EQ(test::metaOf(from), test::metaOf(to));
    const MapDatabase opened({.path = to});
    EXPECT_EQ(test::bitsOf(opened.reader().graph()->map),
              test::bitsOf(test::RandomGraph(seed).map({.shared = 0})));
    EXPECT_FALSE(std::filesystem::exists(to + ".pulled.part"));
  }
  const auto maps = fleet::listMaps(url);
  ASSERT_EQ(maps.size(), 1u);
  EXPECT_EQ(maps[0].vehicle, "town");
  EXPECT_EQ(maps[0].objects, 60);
  EXPECT_EQ(maps[0].anchors, 40);
  EXPECT_TRUE(maps[0].whole);
}

TEST(FleetTransfer, WhatCannotBePulledIsSaidWithTheFix) {
  auto* server = PERDURE_SERVER_OR_SKIP();
  const TemporaryFolder folder;
  const std::string url = server->makeDatabase(), to = folder.file("to");
  EXPECT_THAT(refusalOf([&] { fleet::pullMap(url, "town", to); }), HasSubstr("has no maps"));
  writeMap(folder.file("from"), 7);
  fleet::pushMap(folder.file("from"), url, "town");
  EXPECT_THAT(refusalOf([&] { fleet::pullMap(url, "village", to); }), HasSubstr("map maps"));
  EXPECT_THAT(refusalOf([&] { fleet::pullMap(url, "town", folder.file("from")); }),
              HasSubstr("is there already"));
  server->run(url, "UPDATE perdure.maps SET whole = false");
  EXPECT_THAT(refusalOf([&] { fleet::pullMap(url, "town", to); }), HasSubstr("--unfinished"));
  EXPECT_FALSE(std::filesystem::exists(to));
  fleet::pullMap(url, "town", to, true);
  EXPECT_EQ(test::rowsOf(to, "objects").size(), 60u);
}

TEST(FleetTransfer, ANameThatAVehicleUsesIsNotTaken) {
  auto* server = PERDURE_SERVER_OR_SKIP();
  const TemporaryFolder folder;
  const std::string url = server->makeDatabase();
  Vehicle vehicle(configOf(folder.file("map"), url, "red"), quick());
  vehicle.step(1);
  ASSERT_TRUE(vehicle.fleet().finish(kLong));
  writeMap(folder.file("from"), 7);
  EXPECT_THAT(refusalOf([&] { fleet::pushMap(folder.file("from"), url, "red"); }),
              HasSubstr("--name"));
  EXPECT_EQ(fleet::listMaps(url).size(), 1u);
}

TEST(FleetTransfer, TheMapsOfAllVehiclesAndNoPushedOnesArePulled) {
  auto* server = PERDURE_SERVER_OR_SKIP();
  const TemporaryFolder folder;
  const std::string url = server->makeDatabase();
  for (const std::string name : {"red", "blue"}) {
    Vehicle vehicle(configOf(folder.file(name), url, name), quick());
    vehicle.step(1);
    ASSERT_TRUE(vehicle.fleet().finish(kLong)) << vehicle.fleet().progress().trouble;
  }
  writeMap(folder.file("from"), 7);
  fleet::pushMap(folder.file("from"), url, "town");
  std::filesystem::create_directory(folder.file("maps"));
  EXPECT_THAT(
      fleet::pullVehicles(url, folder.file("maps")),
      ::testing::ElementsAre(folder.file("maps/blue.sqlite"), folder.file("maps/red.sqlite")));
  EXPECT_EQ(test::rowsOf(folder.file("red"), "objects"),
            test::rowsOf(folder.file("maps/red.sqlite"), "objects"));
  server->run(url, "UPDATE perdure.maps SET vehicle = '../red' WHERE vehicle = 'red'");
  EXPECT_THAT(refusalOf([&] { fleet::pullVehicles(url, folder.file("others")); }),
              HasSubstr("cannot be the name of a map"));
}

TEST(FleetTransfer, ChangedTilesAndMapsAreTold) {
  auto* server = PERDURE_SERVER_OR_SKIP();
  const TemporaryFolder folder;
  const std::string url = server->makeDatabase();
  Vehicle vehicle(configOf(folder.file("map"), url), quick());
  vehicle.step(1);
  ASSERT_TRUE(vehicle.fleet().finish(kLong));
  const fleet::Stop stop;
  auto link = fleet::Link::open(url, {}, stop);
  ASSERT_TRUE(link && link->run(std::string("LISTEN ") + fleet::kTilesChannel + "; LISTEN " +
                                fleet::kMapsChannel));
  const Objects objects = test::workingSet(2, {test::carAt(1, {100, -1, 0})});  // from tile 0, 0
  vehicle.node().onObjects(objects);
  vehicle.node().tick(std::chrono::seconds(10));
  vehicle.fleet().wake();
  std::vector<std::string> told;
  for (int i = 0; i < 3; ++i) {
    const auto payload = link->notification(kLong);
    ASSERT_TRUE(payload && *payload);
    told.push_back(**payload);
  }
  EXPECT_THAT(told, ::testing::UnorderedElementsAre("1 3 -1", "1 0 0", "1 2 red"));
}

TEST(FleetGeometry, PlacesOnEarthAreThoseOfTheExactConversion) {
  auto* server = PERDURE_SERVER_OR_SKIP();
  if (!server->hasPostgis()) GTEST_SKIP() << "PostGIS is not installed (deploy/install --fleet)";
  const TemporaryFolder folder;
  const std::string url = server->makeDatabase(true), file = folder.file("map");
  writeMap(file, 8, true);
  const GeoAnchor anchor{{}, 49.0, 8.4, 110.0, 30.0 * std::numbers::pi / 180.0};
  fleet::Replicator replicator({url, "red", {49.0, 8.4, 110.0, 30.0}}, file, quick());
  ASSERT_TRUE(replicator.finish(kLong)) << replicator.progress().trouble;
  EXPECT_EQ(replicator.progress().notice, "");

  const fleet::Stop stop;
  auto link = fleet::Link::open(url, {}, stop);
  ASSERT_TRUE(link);
  const auto places = link->ask(
      "SELECT l.x, l.y, l.z, ST_Y(w.place), ST_X(w.place), ST_Z(w.place), "
      "ST_SRID(w.place)::bigint, ST_SRID(l.place)::bigint, ST_X(l.place) FROM "
      "perdure.objects_local l JOIN perdure.objects_wgs84 w USING(key)");
  ASSERT_TRUE(places) << places.error().detail;
  EXPECT_EQ(places->rows(), 60);
  const GeoReference reference(anchor, {});
  for (int row = 0; row < places->rows(); ++row) {
    const auto exact =
        reference({places->real(row, 0), places->real(row, 1), places->real(row, 2)});
    EXPECT_NEAR(places->real(row, 3), exact.latitude_deg, 1e-10);
    EXPECT_NEAR(places->real(row, 4), exact.longitude_deg, 1e-10);
    EXPECT_NEAR(places->real(row, 5), exact.height_m, 1e-5);
    EXPECT_EQ(places->integer(row, 6), 4326);
    EXPECT_EQ(places->integer(row, 7), 0);
    EXPECT_EQ(places->real(row, 8), places->real(row, 0));
  }
  EXPECT_EQ(server->number(url, "SELECT count(*) FROM perdure.anchors_wgs84"), 40);
  EXPECT_EQ(server->number(url, "SELECT count(*) FROM perdure.ways_wgs84"), 2);
  EXPECT_GT(server->number(url, "SELECT count(*) FROM perdure.loops_local"), 0);
  EXPECT_EQ(server->number(url,
                           "SELECT count(*) FROM geometry_columns WHERE f_table_schema = "
                           "'perdure' AND srid = 4326"),
            4);
}

TEST(FleetGeometry, WithoutAPlaceOnEarthThereAreLocalPlacesUntilItIsKnown) {
  auto* server = PERDURE_SERVER_OR_SKIP();
  if (!server->hasPostgis()) GTEST_SKIP() << "PostGIS is not installed (deploy/install --fleet)";
  const TemporaryFolder folder;
  const std::string url = server->makeDatabase(true);
  Vehicle vehicle(configOf(folder.file("map"), url), quick());
  for (std::uint64_t n = 1; n <= 3; ++n) vehicle.step(n);
  ASSERT_TRUE(vehicle.fleet().finish(kLong)) << vehicle.fleet().progress().trouble;
  EXPECT_EQ(server->number(url, "SELECT count(*) FROM perdure.objects_local"), 3);
  EXPECT_EQ(server->number(url, "SELECT count(*) FROM perdure.objects_wgs84"), 0);

  // The vehicle's receiver gets a position while the server is attached.
  const Objects next = test::workingSet(4, {});
  Calibration rig;
  rig.anchor = GeoAnchor{next.stamp.time, 49.0, 8.4, 110.0, 0.0};
  Odometry odometry;
  odometry.stamp = next.stamp;
  odometry.world = next.world;
  odometry.state = OdometryState::kTracking;
  vehicle.node().onCalibration(rig);
  vehicle.node().onOdometry(odometry);
  vehicle.step(4);
  ASSERT_TRUE(vehicle.fleet().finish(kLong)) << vehicle.fleet().progress().trouble;
  EXPECT_EQ(server->number(url, "SELECT count(*) FROM perdure.objects_wgs84"), 4);
}

/// Prints figures for the README; it has no criterion for passing.
TEST(FleetFigures, DISABLED_OfThisMachine) {
  auto* server = PERDURE_SERVER_OR_SKIP();
  const TemporaryFolder folder;
  const std::string url = server->makeDatabase(true);
  const auto now = [] { return std::chrono::steady_clock::now(); };
  const auto milliseconds = [](auto d) {
    return std::chrono::duration<double, std::milli>(d).count();
  };
  for (const bool with_server : {false, true, false, true}) {
    const std::string name =
        "map" + std::to_string(with_server) + std::to_string(now().time_since_epoch().count());
    Node node(configOf(folder.file(name), with_server ? url : ""), 5, test::noOutputs());
    std::optional<fleet::Replicator> replicator;
    if (with_server) replicator.emplace(configOf("", url, name).fleet, folder.file(name));
    std::vector<double> commits, latencies;
    for (std::uint64_t n = 1; n <= 200; ++n) {
      std::vector<ObjectBelief> cars;
      for (ObjectId id = 1; id <= 60; ++id) {
        cars.push_back(
            test::carAt(id, {2.0 * static_cast<double>(id), 0.01 * static_cast<double>(n), 0}));
      }
      node.onObjects(test::workingSet(n, cars));
      const auto before = now();
      node.tick(std::chrono::milliseconds(600 * n));
      commits.push_back(milliseconds(now() - before));
      if (!replicator) continue;
      replicator->wake();
      ASSERT_TRUE(replicator->finish(kLong));
      latencies.push_back(1e3 * replicator->progress().latency_s);
      node.onAcknowledged(replicator->progress().sent);
    }
    const auto print = [](const char* what, std::vector<double> all) {
      if (all.empty()) return;
      std::sort(all.begin(), all.end());
      std::printf("%s: median %.2f ms, p95 %.2f ms\n", what, all[all.size() / 2],
                  all[all.size() * 19 / 20]);
    };
    print(with_server ? "tick with outbox" : "tick without", commits);
    print("commit to server", latencies);
  }
  const std::string large = folder.file("large");
  {
    MapDatabase database({.path = large});
    std::vector<ObjectBelief> cars;
    for (ObjectId id = 1; id <= 20'000; ++id) {
      cars.push_back(test::carAt(
          id, {2.0 * static_cast<double>(id % 200), 2.0 * static_cast<double>(id / 200), 0}));
    }
    const Objects objects = test::workingSet(1, cars);
    ASSERT_TRUE(database.write({&objects, {}, {}}).has_value());
  }
  const MapDatabase with_outbox({.path = large, .outbox = true});
  const auto before = now();
  fleet::Replicator replicator({url, "large", {}}, large);
  ASSERT_TRUE(replicator.finish(kLong * 5)) << replicator.progress().trouble;
  std::printf("20,000 objects sent whole in %.0f ms\n", milliseconds(now() - before));
  const auto pulling = now();
  fleet::pullMap(url, "large", folder.file("pulled"));
  std::printf("and pulled in %.0f ms\n", milliseconds(now() - pulling));
}

}  // namespace
}  // namespace perdure::map_store
