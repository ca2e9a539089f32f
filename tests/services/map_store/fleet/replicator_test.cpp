// The server has all commits of a vehicle, each once, whichever process ends meanwhile.
#include "services/map_store/fleet/replicator.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <thread>
#include <utility>

#include "common/base/check.h"
#include "services/map_store/core/outbox.h"
#include "services/map_store/fleet/map_transfer.h"
#include "tests/services/map_store/fleet/files.h"
#include "tests/services/map_store/fleet/postgres_server.h"
#include "tests/services/map_store/fleet/wire.h"

namespace perdure::map_store {
namespace {

using test::configOf;
using test::kLong;
using test::quick;
using test::TemporaryFolder;
using test::Vehicle;

/// Expects that the vehicle's file and the server's map are the same, bit by bit.
void expectSame(const std::string& file, const std::string& url, const std::string& vehicle) {
  const TemporaryFolder folder;
  fleet::pullMap(url, vehicle, folder.file("pulled.sqlite"));
  for (const char* table : test::kCommonTables) {
    EXPECT_EQ(test::rowsOf(file, table), test::rowsOf(folder.file("pulled.sqlite"), table))
        << table;
  }
  EXPECT_EQ(test::metaOf(file), test::metaOf(folder.file("pulled.sqlite")));
}

std::int64_t entriesOf(const std::string& file) {
  const auto connection = Connection::open(file, Connection::Mode::kReadOnly).value();
  return connection.integer("SELECT count(*) FROM outbox").value();
}

TEST(FleetReplicator, TheServerHasTheFileBitByBit) {
  auto* server = PERDURE_SERVER_OR_SKIP();
  const TemporaryFolder folder;
  const std::string url = server->makeDatabase(), file = folder.file("map.sqlite");
  Vehicle vehicle(configOf(file, url), quick());
  for (std::uint64_t n = 1; n <= 45; ++n) {
    vehicle.step(n);
    if (n % 15 == 0) {
      ASSERT_TRUE(vehicle.fleet().finish(kLong)) << vehicle.fleet().progress().trouble;
      expectSame(file, url, "red");
    }
  }
  EXPECT_EQ(server->number(url, "SELECT count(*) FROM perdure.objects WHERE gone <> 0"), 4);
  EXPECT_EQ(vehicle.fleet().progress().trouble, "");
}

TEST(FleetReplicator, TheServerHasTheGraphBitByBitAndWhatWasDeletedIsGone) {
  auto* server = PERDURE_SERVER_OR_SKIP();
  const TemporaryFolder folder;
  const std::string url = server->makeDatabase(), file = folder.file("map.sqlite");
  MapDatabase database({.path = file, .outbox = true});
  fleet::Replicator replicator({url, "red", {}}, file, quick());
  mapping::Unsaved graph{test::RandomGraph(3).map({}), {}, {}};
  const auto commit = [&](std::uint64_t n) {
    const Objects objects = test::workingSet(n, {test::carAt(n, {1, 2, 3})});
    Batch batch{&objects, {}, {}};
    batch.graph = &graph;
    batch.acknowledged = replicator.progress().sent;
    ASSERT_TRUE(database.write(batch).has_value());
    replicator.wake();
    ASSERT_TRUE(replicator.finish(kLong)) << replicator.progress().trouble;
    expectSame(file, url, "red");
  };
  commit(1);
  EXPECT_EQ(server->number(url, "SELECT count(*) FROM perdure.edges"), 60);
  graph.edges_gone = {60, 59};
  graph.records_gone = {7};
  for (const auto id : graph.edges_gone) graph.changed.edges.erase(id);
  for (const auto id : graph.records_gone) graph.changed.records.erase(id);
  graph.changed.anchors.begin()->second.T_MA.p.z() = -0.0;
  commit(2);
  EXPECT_EQ(server->number(url, "SELECT count(*) FROM perdure.edges"), 58);
  EXPECT_EQ(server->number(url, "SELECT count(*) FROM perdure.sightings"), 99);
}

TEST(FleetReplicator, WhatTheServerHasLeavesTheOutbox) {
  auto* server = PERDURE_SERVER_OR_SKIP();
  const TemporaryFolder folder;
  const std::string url = server->makeDatabase(), file = folder.file("map.sqlite");
  Vehicle vehicle(configOf(file, url), quick());
  for (std::uint64_t n = 1; n <= 8; ++n) {
    vehicle.step(n);
    ASSERT_TRUE(vehicle.fleet().finish(kLong)) << vehicle.fleet().progress().trouble;
  }
  const std::int64_t in_one_commit = 8 + 1;  // eight cars that moved, and the working set
  EXPECT_LE(entriesOf(file), 2 * in_one_commit);
  const std::uint64_t rows = vehicle.fleet().progress().rows;
  EXPECT_LE(rows, 36u + 8u + 8u);  // each commit sends each changed car once
  vehicle.fleet().wake();
  ASSERT_TRUE(vehicle.fleet().finish(kLong));
  EXPECT_EQ(vehicle.fleet().progress().rows, rows);
}

TEST(FleetReplicator, AWakeWithoutChangesDoesNotCountInTheLatencyOfTheNextOne) {
  auto* server = PERDURE_SERVER_OR_SKIP();
  const TemporaryFolder folder;
  const std::string url = server->makeDatabase(), file = folder.file("map.sqlite");
  Vehicle vehicle(configOf(file, url), quick());
  vehicle.step(1);
  ASSERT_TRUE(vehicle.fleet().finish(kLong)) << vehicle.fleet().progress().trouble;
  vehicle.fleet().wake();
  ASSERT_TRUE(vehicle.fleet().finish(kLong));
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  const auto stepped = std::chrono::steady_clock::now();
  vehicle.step(2);
  ASSERT_TRUE(vehicle.fleet().finish(kLong));
  const auto done = std::chrono::steady_clock::now();
  EXPECT_LE(vehicle.fleet().progress().latency_s,
            std::chrono::duration<double>(done - stepped).count());
}

TEST(FleetReplicator, TwoVehiclesWithTheSameIdsStayApart) {
  auto* server = PERDURE_SERVER_OR_SKIP();
  const TemporaryFolder folder;
  const std::string url = server->makeDatabase();
  const std::string a = folder.file("a.sqlite"), b = folder.file("b.sqlite");
  {
    Vehicle red(configOf(a, url, "red"), quick(), 11), blue(configOf(b, url, "blue"), quick(), 12);
    for (std::uint64_t n = 1; n <= 30; ++n) {
      red.step(n);
      if (n % 2 == 0) blue.step(n / 2);
    }
    ASSERT_TRUE(red.fleet().finish(kLong)) << red.fleet().progress().trouble;
    ASSERT_TRUE(blue.fleet().finish(kLong)) << blue.fleet().progress().trouble;
  }
  expectSame(a, url, "red");
  expectSame(b, url, "blue");
  EXPECT_EQ(server->number(url, "SELECT count(*) FROM perdure.maps"), 2);
  EXPECT_EQ(server->number(url, "SELECT count(*) FROM perdure.objects"), 30 + 15);
}

TEST(FleetReplicator, AServerThatIsAwayForAWhileMissesNothing) {
  auto* server = PERDURE_SERVER_OR_SKIP();
  const TemporaryFolder folder;
  const std::string url = server->makeDatabase(), file = folder.file("map.sqlite");
  Vehicle vehicle(configOf(file, url), quick());
  std::uint64_t n = 0;
  while (n < 15) vehicle.step(++n);
  ASSERT_TRUE(vehicle.fleet().finish(kLong)) << vehicle.fleet().progress().trouble;
  server->crash();
  std::uint64_t refused = 0;
  for (int tries = 0; refused < 3 && tries < 3000; ++tries) {
    if (n < 40) vehicle.step(++n);
    usleep(10'000);
    refused = vehicle.fleet().progress().reasons.of("server_unreachable");
  }
  EXPECT_GE(refused, 3u);
  while (n < 40) vehicle.step(++n);
  EXPECT_EQ(vehicle.node().commits(), 40u);  // the node continued
  EXPECT_EQ(vehicle.node().trouble(), "");
  const std::string trouble = vehicle.fleet().progress().trouble;
  EXPECT_THAT(trouble, ::testing::HasSubstr("server_unreachable"));
  EXPECT_THAT(trouble, ::testing::HasSubstr("see that the server runs"));
  EXPECT_FALSE(vehicle.fleet().finish(std::chrono::milliseconds(0)));
  server->start();
  ASSERT_TRUE(vehicle.fleet().finish(kLong)) << vehicle.fleet().progress().trouble;
  EXPECT_EQ(vehicle.fleet().progress().trouble, "");
  expectSame(file, url, "red");
  EXPECT_EQ(server->number(url, "SELECT count(*) FROM perdure.objects"), 40);
}

/// A vehicle in its own process that drives until it is killed.
class DrivingVehicle {
 public:
  DrivingVehicle(const Config& config, std::uint64_t from) : committed_(from) {
    int ends[2];
    perdure::check(pipe(ends) == 0, "a pipe");
    child_ = fork();
    if (child_ == 0) drive(config, from + 1, ends[1]);
    close(ends[1]);
    pipe_ = ends[0];
  }
  ~DrivingVehicle() {
    if (child_ > 0) kill();
    close(pipe_);
  }
  DrivingVehicle(const DrivingVehicle&) = delete;
  DrivingVehicle& operator=(const DrivingVehicle&) = delete;
  /// Waits until this frame is committed; returns false if the vehicle has ended.
  bool reach(std::uint64_t n) {
    while (committed_ < n && readOne()) {
    }
    return committed_ >= n;
  }
  /// Sends SIGKILL. Returns the last frame whose commit the vehicle reported.
  std::uint64_t kill() {
    ::kill(child_, SIGKILL);
    int status = 0;
    waitpid(std::exchange(child_, 0), &status, 0);
    EXPECT_TRUE(WIFSIGNALED(status));
    while (readOne()) {
    }
    return committed_;
  }

 private:
  [[noreturn]] static void drive(const Config& config, std::uint64_t from, int pipe) {
    auto pace = quick();
    pace.most_rows = 7;  // forces many portions
    Vehicle vehicle(config, pace);
    for (std::uint64_t n = from;; ++n) {
      vehicle.step(n);
      if (write(pipe, &n, sizeof n) != static_cast<ssize_t>(sizeof n)) _exit(1);
      usleep(3000);
    }
  }
  bool readOne() {
    return read(pipe_, &committed_, sizeof committed_) == static_cast<ssize_t>(sizeof committed_);
  }
  std::uint64_t committed_;
  pid_t child_ = 0;
  int pipe_ = -1;
};

TEST(FleetReplicator, AVehicleThatIsKilledLosesAndDoublesNothing) {
  auto* server = PERDURE_SERVER_OR_SKIP();
  const TemporaryFolder folder;
  const std::string url = server->makeDatabase(), file = folder.file("map.sqlite");
  const Config config = configOf(file, url);
  std::uint64_t committed = 0;
  for (std::uint64_t round = 0; round < 4; ++round) {
    DrivingVehicle vehicle(config, committed);
    ASSERT_TRUE(vehicle.reach(committed + 15 + 4 * round));
    usleep(static_cast<useconds_t>(1500 * round));
    committed = vehicle.kill();
  }
  Vehicle again(config, quick());
  ASSERT_TRUE(again.fleet().finish(kLong)) << again.fleet().progress().trouble;
  expectSame(file, url, "red");
  EXPECT_GE(server->number(url, "SELECT count(*) FROM perdure.objects"),
            static_cast<std::int64_t>(committed));
  EXPECT_EQ(server->number(url, "SELECT count(*) FROM perdure.maps"), 1);
}

TEST(FleetReplicator, TwoVehiclesLoseNothingWhileTheServerAndOneOfThemDie) {
  auto* server = PERDURE_SERVER_OR_SKIP();
  const TemporaryFolder folder;
  const std::string url = server->makeDatabase();
  const std::string a = folder.file("a.sqlite"), b = folder.file("b.sqlite");
  const Config config_a = configOf(a, url, "red"), config_b = configOf(b, url, "blue");
  std::uint64_t red_at = 0, blue_at = 0;
  {
    DrivingVehicle red(config_a, 0), blue(config_b, 0);
    ASSERT_TRUE(red.reach(10) && blue.reach(10));
    server->crash();
    ASSERT_TRUE(red.reach(30));
    red_at = red.kill();  // only its file has the changes that it had not sent
    DrivingVehicle red_again(config_a, red_at);
    ASSERT_TRUE(red_again.reach(red_at + 5) && blue.reach(40));
    server->start();
    ASSERT_TRUE(red_again.reach(red_at + 20) && blue.reach(60));
    red_at = red_again.kill();
    blue_at = blue.kill();
  }
  Vehicle red(config_a, quick()), blue(config_b, quick());
  ASSERT_TRUE(red.fleet().finish(kLong)) << red.fleet().progress().trouble;
  ASSERT_TRUE(blue.fleet().finish(kLong)) << blue.fleet().progress().trouble;
  expectSame(a, url, "red");
  expectSame(b, url, "blue");
  EXPECT_GE(server->number(url, "SELECT count(*) FROM perdure.objects"),
            static_cast<std::int64_t>(red_at + blue_at));
  EXPECT_EQ(server->number(url, "SELECT count(*) FROM perdure.maps"), 2);
}

TEST(FleetReplicator, ACommitWhoseAnswerWasLostIsNotSentAgain) {
  auto* server = PERDURE_SERVER_OR_SKIP();
  const TemporaryFolder folder;
  const std::string url = server->makeDatabase(), file = folder.file("map.sqlite");
  test::Relay relay(server->port());
  Vehicle vehicle(configOf(file, test::PostgresServer::through(relay.port(), url)), quick());
  for (std::uint64_t n = 1; n <= 5; ++n) vehicle.step(n);
  ASSERT_TRUE(vehicle.fleet().finish(kLong)) << vehicle.fleet().progress().trouble;
  server->run(url,
              "CREATE TABLE seen(sent bigint); CREATE FUNCTION note() RETURNS trigger LANGUAGE "
              "plpgsql AS $$ BEGIN INSERT INTO seen VALUES(NEW.sent); RETURN NULL; END $$; CREATE "
              "TRIGGER note AFTER UPDATE OF sent ON perdure.maps FOR EACH ROW EXECUTE FUNCTION "
              "note()");
  relay.loseAnswerToCommit();
  vehicle.step(6);
  ASSERT_TRUE(vehicle.fleet().finish(kLong)) << vehicle.fleet().progress().trouble;
  EXPECT_TRUE(relay.lostAnAnswer());
  EXPECT_EQ(vehicle.fleet().progress().reasons.of("server_unreachable"), 1u);
  expectSame(file, url, "red");
  EXPECT_EQ(server->number(url, "SELECT count(*) - count(DISTINCT sent) FROM seen"), 0);
  EXPECT_EQ(server->number(url, "SELECT count(*) FROM seen"), 1);
}

TEST(FleetReplicator, AServerThatBeginsAnewGetsEverything) {
  auto* server = PERDURE_SERVER_OR_SKIP();
  const TemporaryFolder folder;
  const std::string file = folder.file("map.sqlite");
  const std::string first = server->makeDatabase(), second = server->makeDatabase();
  std::uint64_t n = 0;
  for (const std::string& url : {first, second, first}) {
    auto pace = quick();
    pace.most_rows = 9;  // the whole file in several portions
    Vehicle vehicle(configOf(file, url), pace);
    for (int i = 0; i < 12; ++i) vehicle.step(++n);
    ASSERT_TRUE(vehicle.fleet().finish(kLong)) << vehicle.fleet().progress().trouble;
    expectSame(file, url, "red");
  }
}

TEST(FleetReplicator, AFileFromABackupReplacesWhatWasSentSince) {
  auto* server = PERDURE_SERVER_OR_SKIP();
  const TemporaryFolder folder;
  const std::string url = server->makeDatabase(), file = folder.file("map.sqlite");
  const auto drive = [&](std::uint64_t from, std::uint64_t to) {
    Vehicle vehicle(configOf(file, url), quick());
    for (std::uint64_t n = from; n <= to; ++n) vehicle.step(n);
    ASSERT_TRUE(vehicle.fleet().finish(kLong)) << vehicle.fleet().progress().trouble;
  };
  drive(1, 10);
  std::filesystem::copy_file(file, folder.file("backup"));
  drive(11, 30);
  std::filesystem::remove(file);
  std::filesystem::remove(file + "-wal");
  std::filesystem::rename(folder.file("backup"), file);
  drive(11, 12);
  expectSame(file, url, "red");
  EXPECT_EQ(server->number(url, "SELECT count(*) FROM perdure.objects"), 12);
}

TEST(FleetReplicator, AFileThatHadNoServerIsSentWhole) {
  auto* server = PERDURE_SERVER_OR_SKIP();
  const TemporaryFolder folder;
  const std::string url = server->makeDatabase(), file = folder.file("map.sqlite");
  {
    Node alone(configOf(file, ""), 5, test::noOutputs());
    for (std::uint64_t n = 1; n <= 10; ++n) {
      alone.onObjects(test::workingSet(n, {test::carAt(n, {1.0 * static_cast<double>(n), 0, 0})}));
      alone.tick(std::chrono::milliseconds(600 * n));
    }
  }
  Vehicle vehicle(configOf(file, url), quick());
  ASSERT_TRUE(vehicle.fleet().finish(kLong)) << vehicle.fleet().progress().trouble;
  expectSame(file, url, "red");
  EXPECT_EQ(server->number(url, "SELECT count(*) FROM perdure.objects"), 10);
}

}  // namespace
}  // namespace perdure::map_store
